"""What counts as a fault, and what follows: monitors, the table of faults, the ramp. Pure."""

"""What follows from a fault: the table of faults, what is there now, the ramp down. Pure."""

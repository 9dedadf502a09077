"""What the two Festo terminals share: keys and wiring, counts, watchdog, emulation. No device."""

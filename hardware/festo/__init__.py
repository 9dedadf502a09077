"""What the two Festo terminals share: their watchdog, and its emulation."""

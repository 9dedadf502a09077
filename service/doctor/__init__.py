"""Is this PC ready: one finding a check, with what to change."""

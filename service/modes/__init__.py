"""The mode machine: its table, its timers, its events."""

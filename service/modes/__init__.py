"""The mode machine: its table, and the timers and events that drive it. Time is an argument."""

"""Shared memory between the processes: ticks, messages, status. A writer never waits."""

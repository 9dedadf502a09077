"""Shared memory between the processes: the tick records, the messages, the status."""

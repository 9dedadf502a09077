"""The fault campaign: a running daemon, faults at random moments, and what must hold all the same.

`python -m tools.faults`, or `make faults`. The table it prints is the one of docs/safety.md.
"""

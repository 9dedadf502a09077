"""The device process, the only hand on a device that may wait; wiring and addresses checked."""

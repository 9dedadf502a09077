"""The device process, and the table of devices."""

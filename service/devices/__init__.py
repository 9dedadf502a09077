"""The device process, and the table of devices with their wiring. The only hand on a device."""

"""`pneuarm systemd`: the unit file that makes the daemon a service."""

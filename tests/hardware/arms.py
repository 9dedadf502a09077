"""Arms to put behind a device: with vacuum, and without."""

from pneuarm.service.configuration.configuration import load

ARMS = {name: load(None, name).build_arm() for name in ("paper", "table1")}

"""The wall clock of one daemon, set without touching the machine's; see clock_hook."""

import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

CLOCK = "PNEUARM_FAULT_CLOCK"
_HOOK = Path(__file__).resolve().parent / "clock_hook"


class Clock:
    """The offset of the daemon's wall clock, in a file that its processes have mapped."""

    def __init__(self, path: str) -> None:
        self._path = path

    def set(self, offset_s: float) -> None:
        """Set the clock to the machine's time and so much."""
        with open(self._path, "r+b" if os.path.exists(self._path) else "w+b") as file:
            file.write(struct.pack("<q", round(offset_s * 1e9)))


@contextmanager
def settable_clock(folder: Path) -> Iterator[None]:
    """Let every Python process that is started inside have a clock that can be set."""
    path = str(folder / "clock")
    Clock(path).set(0.0)
    before = {name: os.environ.get(name) for name in (CLOCK, "PYTHONPATH")}
    os.environ[CLOCK] = path
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (str(_HOOK), before["PYTHONPATH"])))
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value

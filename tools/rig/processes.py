"""What the kernel says of other people's processes."""

import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple


class Process(NamedTuple):
    """A process as the kernel has it now; ``state`` is its letter, Z for a zombie."""

    pid: int
    state: str
    parent: int
    group: int
    lived_s: float

    @property
    def command(self) -> str:
        """Its command line; empty once it is gone."""
        try:
            return Path(f"/proc/{self.pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
        except OSError:
            return ""


def process(pid: int) -> Process:
    """Read what is known of a process; raises OSError for one that is gone."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    begun_s = int(fields[19]) / os.sysconf("SC_CLK_TCK")
    lived_s = time.clock_gettime(time.CLOCK_BOOTTIME) - begun_s
    return Process(pid, fields[0], int(fields[1]), int(fields[2]), lived_s)


def processes() -> Iterator[Process]:
    """Yield all that there are now."""
    for path in Path("/proc").glob("[0-9]*"):
        try:
            yield process(int(path.name))
        except OSError:
            continue  # it has ended meanwhile


def own_memory_bytes(pid: int) -> int:
    """Own memory of a process; the rings, which all processes of a daemon share, do not count."""
    status = Path(f"/proc/{pid}/status").read_text()
    (line,) = (line for line in status.splitlines() if line.startswith("RssAnon"))
    return 1024 * int(line.split()[1])

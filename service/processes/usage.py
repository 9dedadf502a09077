"""What each process of the daemon uses: share of a core and memory, from /proc."""

import os
from dataclasses import dataclass
from multiprocessing.context import SpawnContext
from multiprocessing.sharedctypes import RawArray
from typing import Any

from pneuarm.logs.schema import pneuarm_pb2 as pb

NAMES = ("supervisor", "control", "gateway", "recorder", "viewer", "rerun", "device")
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True)
class ProcessTable:
    """Process numbers and restarts, written by the supervisor (rerun's number by the viewer)."""

    words: Any

    @classmethod
    def create(cls, context: SpawnContext) -> "ProcessTable":
        """Make an empty table."""
        return cls(RawArray("q", 2 * len(NAMES)))

    def started(self, name: str, pid: int, restarts: int = 0) -> None:
        """Note a process."""
        index = 2 * NAMES.index(name)
        self.words[index], self.words[index + 1] = pid, restarts

    def rows(self) -> list[tuple[str, int, int]]:
        """Return name, process number and restarts of every process that was started."""
        return [
            (name, int(self.words[2 * index]), int(self.words[2 * index + 1]))
            for index, name in enumerate(NAMES)
            if self.words[2 * index]
        ]


class ProcessUsage:
    """Shares of a core since the last reading."""

    def __init__(self, table: ProcessTable) -> None:
        self._table = table
        self._last: dict[int, tuple[float, float]] = {}

    def read(self, now_s: float, dropped: dict[str, int]) -> list[pb.ProcessHealth]:
        """Return one row a process that is alive."""
        rows = []
        for name, pid, restarts in self._table.rows():
            used = _used(pid)
            if used is None:
                continue
            cpu_s, memory = used
            before_s, before_cpu_s = self._last.get(pid, (now_s, cpu_s))
            self._last[pid] = (now_s, cpu_s)
            elapsed_s = now_s - before_s
            rows.append(
                pb.ProcessHealth(
                    name=name,
                    pid=pid,
                    cpu_share=(cpu_s - before_cpu_s) / elapsed_s if elapsed_s > 0 else 0.0,
                    memory_bytes=memory,
                    dropped=dropped.get(name, 0),
                    restarts=restarts,
                )
            )
        return rows


def _used(pid: int) -> tuple[float, int] | None:
    """Processor time (s) and resident memory (bytes) of a process, or None if it is gone."""
    try:
        with open(f"/proc/{pid}/stat") as file:
            fields = file.read().rpartition(")")[2].split()
        with open(f"/proc/{pid}/statm") as file:
            resident_pages = int(file.read().split()[1])
    except OSError:
        return None
    return (int(fields[11]) + int(fields[12])) / _TICKS_PER_S, resident_pages * _PAGE_BYTES

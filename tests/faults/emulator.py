"""An emulated device in a process of its own, and the record of what has reached it."""

import contextlib
import json
import os
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.faults.program import Program

#: Gauge pressure below which a chamber counts as empty, Pa.
EMPTY_PA = 1000.0


class Emulator:
    """`pneuarm emulate WHAT`, with the tables that make a daemon use it."""

    def __init__(self, what: str, folder: Path) -> None:
        self.record = Path(tempfile.mkstemp(".jsonl", "device-", folder)[1])
        port = ("--port", "0") if what.startswith("festo") else ()
        self._program = Program(
            "pneuarm", "emulate", what, "--arm", "paper", *port, "--record", str(self.record)
        )
        self.tables = self._configuration()
        with contextlib.suppress(OSError):  # it stands for another machine, which has nothing else
            os.sched_setscheduler(self._program.process.pid, os.SCHED_FIFO, os.sched_param(70))

    def _configuration(self) -> dict[str, dict[str, Any]]:
        """Read the lines that it prints, up to the last, which names the faults."""
        lines: list[str] = []
        while not lines or not lines[-1].startswith("# faults"):
            lines.append(self._program.hear(""))
        tables: dict[str, Any] = tomllib.loads("\n".join(lines))
        return {name: table for name, table in tables.items() if isinstance(table, dict)}

    def inject(self, words: str) -> None:
        """Break something; returns once it is broken."""
        self._program.ask(words, f"fault      {words}")

    def kill(self) -> None:
        """End it."""
        self._program.kill()


@dataclass
class Record:
    """What reached the device; times monotonic, ns. Shapes (n,) and (n, chambers).

    Setpoints stand until the next; ``true_pa`` are the real pressures, sampled.
    """

    time_ns: np.ndarray
    setpoints_pa: np.ndarray
    why: list[str]
    sampled_ns: np.ndarray
    true_pa: np.ndarray


def read_record(path: Path) -> Record:
    """Read a device's record; the line that is being written is left out."""
    setpoints, samples = [], []
    for line in path.read_text().splitlines():
        try:
            entry = json.loads(line)
        except json.JSONDecodeError:
            continue
        (setpoints if "why" in entry else samples).append(entry)
    return Record(
        time_ns=np.array([round(entry["time_s"] * 1e9) for entry in setpoints], dtype=np.int64),
        setpoints_pa=np.array([entry["setpoints_pa"] for entry in setpoints]).reshape(
            len(setpoints), -1
        ),
        why=[entry["why"] for entry in setpoints],
        sampled_ns=np.array([round(entry["time_s"] * 1e9) for entry in samples], dtype=np.int64),
        true_pa=np.array([entry["true_pa"] for entry in samples]).reshape(len(samples), -1),
    )

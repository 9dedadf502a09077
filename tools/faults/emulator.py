"""An emulated device in a process of its own, and the record of what has reached it."""

import contextlib
import json
import os
import tempfile
import tomllib
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from pneuarm.hardware.simulator.parameters import Valves
from tools.faults.program import Program

#: Gauge pressure below which a chamber counts as empty, Pa.
EMPTY_PA = 1000.0

#: The newest setpoints are not farther from the end of a record than this.
_LAST_BYTES = 1 << 18


#: A serial line acknowledges no setpoint, and its emulator notes it when it comes to read it.
_SERIAL_JITTER_S = 0.01

#: What a device that cannot move the default arm needs of it: an ESP32's pump gives 0.13 bar.
_SECTIONS: dict[str, dict[str, float]] = {
    "esp32": {
        "pressure_min_bar": 0.0,
        "pressure_max_bar": 0.12,
        "pressure_slew_max_bar_s": 0.6,
        "lengthening_mm_per_bar": 800.0,
    }
}


def _own_tables(what: str) -> dict[str, Any]:
    """Tables of an arm that the device can move, and what the device shows of itself."""
    if what.startswith("festo"):
        return {what.replace("-", "_"): {"failsafe_register": 46101}}
    if what not in _SECTIONS:
        return {}
    preset = files("pneuarm.service.configuration").joinpath("presets", "paper.toml")
    section = tomllib.loads(preset.read_text())["arm"]["sections"][0]
    return {"arm": {"sections": [section | _SECTIONS[what]]}}


class Emulator:
    """`pneuarm emulate WHAT`, with the tables that make a daemon use it."""

    def __init__(self, what: str, folder: Path, valves: Valves = "servo") -> None:
        own = _own_tables(what) | {"simulator": {"valves": valves}}
        arm = folder / f"{what}.toml"
        arm.write_text(tomli_w.dumps(own))
        self.jitter_s = 0.0 if what.startswith("festo") else _SERIAL_JITTER_S
        self.record = Path(tempfile.mkstemp(".jsonl", "device-", folder)[1])
        self._program = Program(
            "pneuarm", "emulate", what, "--arm", str(arm), "--record", str(self.record)
        )
        self.tables = dict(own)
        for name, table in self._configuration().items():
            self.tables[name] = own.get(name, {}) | table
        self._go_first()

    def _configuration(self) -> dict[str, dict[str, Any]]:
        """Read the lines that it prints, up to the last, which names the faults."""
        lines: list[str] = []
        while not lines or not lines[-1].startswith("# faults"):
            lines.append(self._program.hear(""))
        tables: dict[str, Any] = tomllib.loads("\n".join(lines))
        return {name: table for name, table in tables.items() if isinstance(table, dict)}

    def _go_first(self) -> None:
        """It stands for another machine, which has nothing else to do: real time where granted."""
        for task in Path(f"/proc/{self._program.process.pid}/task").iterdir():
            with contextlib.suppress(OSError):
                os.sched_setscheduler(int(task.name), os.SCHED_FIFO, os.sched_param(70))

    def is_zeroed(self) -> bool:
        """Whether its last setpoints are zeros."""
        return not any(self._newest("setpoints_pa"))

    def is_empty(self) -> bool:
        """Whether there is no air in the chambers any more."""
        return max(map(abs, self._newest("true_pa"))) < EMPTY_PA

    def _newest(self, name: str) -> list[float]:
        """Last whole line of the record that has this key, looked for in its last part."""
        with self.record.open("rb") as file:
            file.seek(max(0, self.record.stat().st_size - _LAST_BYTES))
            lines = file.read().split(b"\n")[1:-1]
        return next(json.loads(line)[name] for line in reversed(lines) if name.encode() in line)

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
    setpoints: list[dict[str, Any]] = []
    samples: list[dict[str, Any]] = []
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

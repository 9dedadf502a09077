"""Emulated devices as processes of their own, for the tests of whole daemons."""

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

from tools.rig.daemon import ROOT


class Emulator:
    """`pneuarm emulate NAME`; ``tables`` makes a daemon use it, ``say`` injects a fault."""

    def __init__(self, name: str, folder: Path, *arguments: str) -> None:
        self.path = folder / f"{name}.jsonl"
        self._process = subprocess.Popen(
            [sys.executable, "-m", "pneuarm", "emulate", name, "--record", self.path, *arguments],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
        )
        lines: list[str] = []
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith("# faults"):
                break
            lines.append(line)
        self.tables: dict[str, dict[str, Any]] = tomllib.loads("".join(lines))
        self.tables.pop("preset")
        # A test machine may be busier than any robot's.
        self.tables["hardware"] |= {"exchange_rate_hz": 100.0}
        self.tables["control"] = {"rate_hz": 250.0}
        festo = name.startswith("festo")
        patient = {"timeout_ms": 150.0, "watchdog_ms": 500} if festo else {"timeout_ms": 3000.0}
        self.tables[name.replace("-", "_")] |= patient

    def say(self, words: str) -> None:
        """Inject a fault; returns once it is there."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(words + "\n")
        answer = self._process.stdout.readline()
        assert answer.split() == ["fault", *words.split()], answer

    def changes(self) -> list[tuple[float, str, list[float]]]:
        """Return every change of the setpoints: when, why, and to what (Pa)."""
        entries = [json.loads(line) for line in self.path.read_text().splitlines()[:-1]]
        return [
            (entry["time_s"], entry["why"], entry["setpoints_pa"])
            for entry in entries
            if "setpoints_pa" in entry
        ]

    def zero_since(self) -> float | None:
        """Return since when all setpoints have been zero, None while they are not."""
        since: float | None = None
        for time_s, _, setpoints in self.changes():
            if any(setpoints):
                since = None
            elif since is None:
                since = time_s
        return since

    def __enter__(self) -> "Emulator":
        return self

    def __exit__(self, *_: object) -> None:
        if self._process.poll() is None:
            os.kill(self._process.pid, 15)
        self._process.wait(10)

"""The table of a campaign, for the terminal and for docs/safety.md."""

import statistics
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from pneuarm.hardware.simulator.parameters import Valves
from tools.faults.fault import Row
from tools.faults.stop_latency import StopLatency

BEGIN, END = "<!-- campaign -->", "<!-- /campaign -->"


@dataclass
class Report:
    """What a campaign has found; the stop's latency is measured at its end."""

    seed: int
    rows: list[Row] = field(default_factory=list)
    stop: StopLatency | None = None
    seconds: float = 0.0
    interrupted: bool = False
    #: How many faults there are to come in all; 0 where that is not known.
    faults: int = 0
    valves: Valves = "servo"

    @property
    def broken(self) -> list[str]:
        """One line for every invariant that was broken, and how to see it again."""
        lines = [
            f"{i.fault}, seed {i.seed}: {_line(what)}  (again: python -m tools.faults --only "
            f"{i.fault!r} --times 1 --seed {i.seed} --valves {self.valves})"
            for row in self.rows
            for i in row.injections
            for what in i.broken
        ]
        return lines + (self.stop.broken if self.stop else [])

    def table(self) -> str:
        """One row a fault, as Markdown."""
        lines = [
            "| fault | the arm | times | invariants kept | to the safe state, median | worst "
            "| chambers below 10 mbar, median | worst |",
            "|---|---|---|---|---|---|---|---|",
        ]
        for row in self.rows:
            kept = sum(i.kept for i in row.injections)
            checks = sum(i.checks for i in row.injections)
            cells = [row.fault.name, row.fault.policy, f"{len(row.injections)}"]
            cells += [row.unable or f"{kept} of {checks}"]
            cells += [*_times(row.times_s), *_times(row.empty_s)]
            lines.append(f"| {' | '.join(cells)} |")
        return "\n".join(lines)

    def markdown(self) -> str:
        """Everything that stands between the comments of the page."""
        injections = sum(len(row.injections) for row in self.rows)
        day = datetime.now(UTC).strftime("%Y-%m-%d")
        text = [
            f"`make faults`, {day}: {injections} injections in {self.seconds / 60:.0f} min, "
            f"{self.valves} valves, seed {self.seed}, {len(self.broken)} invariants "
            f"broken{self._unfinished}.",
            self.table(),
        ]
        if lines := [f"- {line}" for row in self.rows if (line := figures(row))]:
            text.append("\n".join(lines))
        if self.stop:
            text.append(self.stop.text())
        if self.broken:
            text.append("\n".join(f"- {line}" for line in self.broken))
        return "\n\n".join(text)

    @property
    def _unfinished(self) -> str:
        done = len(self.rows)
        return f"; unfinished: {done} of {self.faults} faults" if done < self.faults else ""

    def json(self) -> dict[str, Any]:
        """The same for programs."""
        return {
            "seed": self.seed,
            "valves": self.valves,
            "seconds": self.seconds,
            "interrupted": self.interrupted,
            "broken": self.broken,
            "stop": self.stop.json() if self.stop else None,
            "faults": [
                {
                    "fault": row.fault.name,
                    "policy": row.fault.policy,
                    "times": len(row.injections),
                    "unable": row.unable,
                    "kept": sum(i.kept for i in row.injections),
                    "checks": sum(i.checks for i in row.injections),
                    "to_safe_s": row.times_s,
                    "figures": [i.figures for i in row.injections],
                }
                for row in self.rows
            ],
        }


def _line(text: str) -> str:
    """One line of a text that may be a daemon's whole output."""
    return text if len(text) <= 200 else " ".join(text[:200].split()) + " ..."


def _times(times_s: list[float]) -> list[str]:
    """Median and worst, for two cells; empty where there is none."""
    if not times_s:
        return ["", ""]
    return [f"{1e3 * statistics.median(times_s):.0f} ms", f"{1e3 * max(times_s):.0f} ms"]


def figures(row: Row) -> str:
    """Say what else was measured of a fault: median and largest of every figure."""
    names = sorted({name for i in row.injections for name in i.figures})
    parts = []
    for name in names:
        values = [i.figures[name] for i in row.injections if name in i.figures]
        label, scale, unit = _label(name)
        if unit == "" and any(values):
            parts.append(f"{label} {sum(values):.0f} times of {len(values)}")
        if unit == "":
            continue
        median, largest = statistics.median(values) * scale, max(values) * scale
        total = f", {sum(values):.0f} in all" if unit == " of them" else ""
        parts.append(f"{label} {median:.3g}{unit} (largest {largest:.3g}{unit}{total})")
    return f"{row.fault.name}: {'; '.join(parts)}." if parts else ""


def _label(name: str) -> tuple[str, float, str]:
    """Words, scale and unit of a figure; its unit is the end of its name."""
    words, _, unit = name.rpartition("_")
    scale, shown = {
        "ms": (1.0, " ms"),
        "mm": (1.0, " mm"),
        "hz": (1.0, " a second"),
        "bytes": (1 / 2**20, " MiB"),
        "number": (1.0, " of them"),
        "times": (1.0, ""),
    }[unit]
    return words.replace("_", " "), scale, shown


def write_page(page: Path, text: str) -> None:
    """Put the text between the comments of a page; raises ValueError where they are missing."""
    before, _, after = _parts(page)
    page.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}")


def write_again(page: Path, report: Report) -> None:
    """Put the rows of some faults in the place of those that stand in the page, and say so."""
    _, known, _ = _parts(page)
    heads = [f"| {row.fault.name} |" for row in report.rows]
    new = dict(zip(heads, report.table().splitlines()[2:], strict=True))
    own = tuple(f"- {row.fault.name}{mark}" for row in report.rows for mark in (":", ", seed"))
    lines = [
        next((new[head] for head in heads if line.startswith(head)), line)
        for line in known.strip().splitlines()
        if not line.startswith(own)
    ]
    names = ", ".join(row.fault.name for row in report.rows)
    injections = sum(len(row.injections) for row in report.rows)
    lines += [
        "",
        f"Again: {names}: {injections} injections, {report.valves} valves, seed {report.seed}, "
        f"{len(report.broken)} invariants broken; these rows are of that run.",
        "",
        *(f"- {line}" for row in report.rows if (line := figures(row))),
        *(f"- {line}" for line in report.broken),
    ]
    write_page(page, "\n".join(lines).strip())


def _parts(page: Path) -> tuple[str, str, str]:
    before, begin, rest = page.read_text().partition(BEGIN)
    known, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"{page} lacks the comments {BEGIN} and {END}")
    return before, known, after

"""What came of the show: figures from its logs."""

import os
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneuarm.controllers.feedback.estimator import EstimateSource
from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.reading.summary import summarise


@dataclass(frozen=True)
class Drawn:
    """Where the records of a part are, and the first and last tick of each of its phases."""

    name: str
    log: Path
    phases: dict[str, list[int]]


@dataclass(frozen=True)
class Figures:
    """What `pneuarm demo --json` prints; latencies in microseconds.

    ``tip_rms_error_mm`` is that of the last part; ``eight_rms_error_mm`` has the figure of eight of
    every part. The tip is the true one where it is known, else the estimated.
    """

    ticks: int
    rate_hz: float
    overruns: int
    wake_us: dict[str, float]
    compute_us: dict[str, float]
    missing_records: int
    tip_rms_error_mm: float
    eight_rms_error_mm: dict[str, float]
    log: str
    logs: list[str]
    log_bytes: int


@dataclass(frozen=True)
class _Read:
    """The ticks of one part."""

    drawn: Drawn
    ticks: np.ndarray
    missing_ticks: int
    log_bytes: int

    @property
    def span_s(self) -> float:
        times = self.ticks["time_unix_ns"]
        return (int(times[-1]) - int(times[0])) * 1e-9

    def error_mm(self, *phases: str) -> float:
        """RMS distance of the tip from where it was to be, over some phases."""
        ticks = self.ticks
        # Only a simulated arm knows its true tip; a device's is the estimate.
        known = not np.isnan(ticks["tip_true_position_m"]).all()
        tip = ticks["tip_true_position_m" if known else "tip_estimated_position_m"]
        inside = np.zeros(len(ticks), dtype=bool)
        for phase in phases:
            first, last = self.drawn.phases[phase]
            inside |= (ticks["sequence"] >= first) & (ticks["sequence"] <= last)
        square = ((tip - ticks["target_position_m"])[inside] ** 2).sum(axis=1)
        return 1e3 * float(np.sqrt(np.nanmean(square)))

    @property
    def name(self) -> str:
        """Of the part; behind a device, by what the tip is estimated."""
        if self.drawn.name != "device":
            return self.drawn.name
        senses = (self.ticks["tip_estimated_source"] == EstimateSource.LENGTHS).any()
        return "by lengths" if senses else "by pressures"


def _read(drawn: Drawn) -> _Read:
    reader = LogReader(drawn.log)
    summary = summarise(reader)
    return _Read(drawn, reader.ticks(), summary.missing_ticks, summary.size_bytes)


def evaluate(drawn: Sequence[Drawn]) -> Figures:
    """Read the figures of the show from its logs."""
    runs = [_read(part) for part in drawn]
    ticks = [run.ticks for run in runs]
    last = runs[-1]
    moving = [name for name in ("circle", "eight") if name in last.drawn.phases]
    return Figures(
        ticks=sum(map(len, ticks)),
        rate_hz=sum(len(each) - 1 for each in ticks) / sum(run.span_s for run in runs),
        overruns=sum(int(each["overruns"][-1]) for each in ticks),
        wake_us=_latency(np.concatenate([each["wake_latency_s"] for each in ticks])),
        compute_us=_latency(np.concatenate([each["compute_s"][1:] for each in ticks])),
        missing_records=sum(run.missing_ticks for run in runs),
        tip_rms_error_mm=last.error_mm(*moving),
        eight_rms_error_mm={run.name: run.error_mm("eight") for run in runs},
        log=str(last.drawn.log),
        logs=[str(run.drawn.log) for run in runs],
        log_bytes=sum(run.log_bytes for run in runs),
    )


def _latency(seconds: np.ndarray) -> dict[str, float]:
    p50, p99 = np.percentile(seconds, (50, 99)) * 1e6
    maximum = float(seconds.max()) * 1e6
    return {"p50": round(p50, 2), "p99": round(p99, 2), "max": round(maximum, 2)}


_MEANING = {
    "uncalibrated": "nominal model, the tip is not measured",
    "calibrated": "calibrated model, the tip is not measured",
    "feedback": "calibrated model, the tip measured at 100 Hz, 10 ms late",
    "by pressures": "only the model's own error shows: the true tip is not measured",
    "by lengths": "the device's length sensors see it; the arm is not calibrated",
}


def table(figures: Figures) -> str:
    """Return the figures for people, and how to see the sessions again."""
    wake, compute = figures.wake_us, figures.compute_us
    row = "{:18} {:>12}   {}".format
    errors = [
        row(f"error {name}"[:18], f"{error:.2f} mm", _MEANING.get(name, ""))
        for name, error in figures.eight_rms_error_mm.items()
    ]
    lines = [
        "",
        "tip against the same figure of eight, RMS:",
        *errors,
        row("ticks", figures.ticks, f"{figures.rate_hz:.2f} Hz, {figures.overruns} overruns"),
        row("wake latency", f"{wake['p50']:.1f} us", _tail(wake)),
        row("computing time", f"{compute['p50']:.1f} us", _tail(compute)),
        row("records missing", figures.missing_records, ""),
        row("logs", f"{figures.log_bytes / 1e6:.1f} MB", f"{len(figures.logs)} sessions"),
        "",
        "see it again:",
        *(f"  {_program('pneuarm')} replay {log}" for log in figures.logs),
        f"  {_program('rerun')} {figures.log}",
    ]
    return "\n".join(line.rstrip() for line in lines)


def _program(name: str) -> str:
    """Return how to call a program of this environment from here."""
    own = Path(sys.executable).with_name(name)
    found = shutil.which(name)
    if found is not None and Path(found).samefile(own):
        return name
    return os.path.relpath(own)


def _tail(latency: dict[str, float]) -> str:
    return f"median; p99 {latency['p99']:.1f} us, max {latency['max']:.1f} us"

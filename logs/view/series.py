"""The time series of the live view: every tick of a batch, one ``send_columns`` an entity.

Plots are read by people: lengths and errors in mm, pressures in bar, times in microseconds.
"""

from collections.abc import Iterator

import numpy as np
import rerun as rr

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.view.styles import TIPS, Styles

_SCALARS = rr.Scalars.descriptor_scalars()


class Series:
    """The series of one arm in one recording."""

    def __init__(self, arm: Arm, recording: rr.RecordingStream) -> None:
        self._arm = arm
        self._recording = recording
        self._bounds = dict(_bounds(arm))
        self._open: set[str] = set()
        self._overruns: int | None = None
        self._mode = -1  # none yet: the first tick's mode is a change

    def start(self) -> None:
        """Send names, colours and widths of all series."""
        Styles(self._recording).send(self._arm)

    def show(self, ticks: np.ndarray) -> None:
        """Send all ticks, shape (n,) with n > 0; the recording's time is that of the newest."""
        index = _time_columns(ticks)
        for path, values in _values(ticks):
            self._send(path, index, values)
        for path, bounds in self._bounds.items():
            self._recording.log(path, bounds)
        self._show_overruns(ticks)
        self._show_modes(ticks)

    def _send(self, path: str, index: list[rr.TimeColumn], values: Array) -> None:
        """Send values (n, k), if any is known.

        A series that becomes unknown gets its NaN rows once, so that the plot shows a gap there
        and not a straight line to where it is known again.
        """
        unknown = np.isnan(values)
        if unknown.all() and path not in self._open:
            return
        self._recording.send_columns(path, index, [_column(values)])
        if unknown[-1].all():
            self._open.discard(path)
        else:
            self._open.add(path)

    def _show_overruns(self, ticks: np.ndarray) -> None:
        counts = ticks["overruns"].astype(np.int64)
        before = counts[0] if self._overruns is None else self._overruns
        self._overruns = int(counts[-1])
        late = ticks[np.diff(counts, prepend=before) > 0]
        if len(late):
            values = _column(1e6 * late["compute_s"][:, None])
            self._recording.send_columns("timing_us/overrun", _time_columns(late), [values])

    def _show_modes(self, ticks: np.ndarray) -> None:
        modes = ticks["mode"].astype(np.int64)
        changed = ticks[np.diff(modes, prepend=self._mode) != 0]
        self._mode = int(modes[-1])
        if len(changed):
            states = rr.StateChange.columns(state=[pb.Mode.Name(int(m)) for m in changed["mode"]])
            self._recording.send_columns("mode", _time_columns(changed), states)


def _time_columns(ticks: np.ndarray) -> list[rr.TimeColumn]:
    return [
        rr.TimeColumn("tick", sequence=ticks["sequence"].astype(np.int64)),
        rr.TimeColumn("time", timestamp=ticks["time_unix_ns"].astype("datetime64[ns]")),
    ]


def _column(values: Array) -> rr.ComponentColumn:
    """Values (n, k) as n rows of k scalars; a third of the cost of ``rr.Scalars.columns``."""
    offsets = np.arange(0, values.size + 1, values.shape[1], dtype=np.int32)
    scalars = rr.components.ScalarBatch(values.reshape(-1))
    return rr.ComponentColumn(_SCALARS, scalars, offsets=offsets)


def _values(ticks: np.ndarray) -> Iterator[tuple[str, Array]]:
    """Paths and values (n, k) of everything that has k values at every tick."""
    yield from _per_section("length_mm", "commanded", 1e3 * ticks["length_commanded_m"])
    yield from _per_section("length_mm", "estimated", 1e3 * ticks["length_estimated_m"])
    yield from _per_section("pressure_bar", "commanded", 1e-5 * ticks["pressure_commanded_pa"])
    yield from _per_section("pressure_bar", "measured", 1e-5 * ticks["pressure_measured_pa"])
    for tip in TIPS:
        miss_m = ticks[f"tip_{tip}_position_m"] - ticks["target_position_m"]
        yield f"tip_error_mm/{tip}", 1e3 * np.sqrt((miss_m**2).sum(axis=1, keepdims=True))
    times_s = np.stack([ticks["wake_latency_s"], ticks["compute_s"]], axis=1)
    yield "timing_us/loop", 1e6 * times_s


def _per_section(plot: str, kind: str, values: Array) -> Iterator[tuple[str, Array]]:
    """Split values (n, n_sections, 3) into series (n, 3)."""
    for section in range(values.shape[1]):
        yield f"{plot}/section{section + 1}/{kind}", values[:, section]


def _bounds(arm: Arm) -> Iterator[tuple[str, rr.Scalars]]:
    """Paths and lower and upper bounds."""
    low_m, high_m = length_bounds_m(arm)
    for number, section in enumerate(arm.sections, start=1):
        lengths_m = np.array([low_m[number - 1, 0], high_m[number - 1, 0]])
        yield f"length_mm/section{number}/bounds", rr.Scalars(1e3 * lengths_m)
        pressures_pa = np.array([section.pressure_min_pa, section.pressure_max_pa])
        yield f"pressure_bar/section{number}/bounds", rr.Scalars(1e-5 * pressures_pa)

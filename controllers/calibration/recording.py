"""What a calibration is fitted to: pressures sent, pressures and tip measured, over time.

A place counts where the pressures that act were slow for long enough, whatever was sent to make
them so: a dither, a lead and a correction that creeps are no motion. A stretch that stands gives
one place, at its end; one that moves slowly gives several.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pneuarm.controllers.arm.arm import Array, Response
from pneuarm.controllers.arm.errors import CalibrationError
from pneuarm.controllers.calibration.valves import lagged, on_grid

#: Pressures that act and change no faster than this (Pa/s) leave the arm where they belong. Behind
#: slow valves nobody knows so well what acts: there they change by no more than this (Pa) in a lag.
SLOW_PA_S, _LATE_PA = 1e4, 2000.0
#: Pressures that change no faster than this (Pa/s) count as still.
STILL_PA_S = 3000.0
#: The tip is averaged over this time (s): about one swing of a soft arm.
AVERAGED_S = 0.4
#: So long (s) must pressures have been slow before that, for the arm to have come to rest.
SETTLING_S = 0.15
#: In a stretch of slow motion the next place is where a pressure has changed by this (Pa).
_APART_PA = 4000.0
#: A dither is averaged away over this time (s), which holds whole periods of it.
_SMOOTHED_S = 0.12
#: From one averaged time to the next a settled pressure (Pa) and tip (m) change less than this.
SETTLED_PA, _SETTLED_M = 600.0, 1e-3
#: A rest whose measured pressure changes by more (Pa) from one half of it to the other is none.
_RESTLESS_PA = 1500.0
#: Between two recordings that are joined (s).
_APART_S = 3.0
#: A measured tip pose older than this (s) is no measurement of now.
_OLDEST_S = 0.2


@dataclass(frozen=True)
class Recording:
    """Samples in the order of time, some 100 a second.

    ``time_s`` (samples,), ``sent_pa`` and ``measured_pa`` (samples, n_sections, 3) gauge, what was
    sent to the valves and what the chambers answered, ``tip_m`` (samples, 3) the measured tip
    position and ``tip_rotation`` (samples, 3, 3) its rotation, NaN where there was none; None is a
    recording without rotations. The arm was vented at the first sample.
    """

    time_s: Array
    sent_pa: Array
    measured_pa: Array
    tip_m: Array
    tip_rotation: Array | None = None

    @property
    def n_sections(self) -> int:
        """Number of sections of the arm."""
        return int(self.sent_pa.shape[1])


def joined(recordings: "list[Recording]") -> Recording:
    """Recordings one after the other, so far apart that what is between them is no step."""
    times, end_s = [], 0.0
    for recording in recordings:
        times.append(recording.time_s - recording.time_s[0] + end_s)
        end_s = times[-1][-1] + _APART_S
    unknown = [np.full((len(recording.time_s), 3, 3), np.nan) for recording in recordings]
    rotations = [
        nothing if recording.tip_rotation is None else recording.tip_rotation
        for recording, nothing in zip(recordings, unknown, strict=True)
    ]
    return Recording(
        np.concatenate(times),
        np.concatenate([recording.sent_pa for recording in recordings]),
        np.concatenate([recording.measured_pa for recording in recordings]),
        np.concatenate([recording.tip_m for recording in recordings]),
        np.concatenate(rotations),
    )


def fresh_tips(tip_m: Array, age_s: Array) -> Array:
    """Tip positions (samples, 3) with NaN where the measurement was too old."""
    return np.where((age_s < _OLDEST_S)[:, None], tip_m, np.nan)


def acting_pa(recording: Recording, response: Response) -> Array:
    """Pressures (samples, n_sections, 3) in the chambers: sent, behind the valves, no dither.

    The lag takes back the lead by which setpoints run ahead of it.
    """
    grid_s, sent = on_grid(recording.time_s, recording.sent_pa)
    behind = lagged(sent, response)
    flat = _smoothed(behind.reshape(len(grid_s), -1), grid_s)
    columns = [np.interp(recording.time_s, grid_s, column) for column in flat.T]
    return np.stack(columns, axis=1).reshape(recording.sent_pa.shape)


def _smoothed(columns: Array, grid_s: Array) -> Array:
    """Mean over ``_SMOOTHED_S`` around every point of an even grid."""
    half = max(1, round(0.5 * _SMOOTHED_S / float(grid_s[1] - grid_s[0]))) if len(grid_s) > 1 else 1
    padded = np.concatenate([columns[:1].repeat(half, 0), columns, columns[-1:].repeat(half, 0)])
    sums = np.concatenate([np.zeros((1, columns.shape[1])), np.cumsum(padded, axis=0)])
    mean: Array = (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)
    return mean


def settled(
    time_s: Array,
    measured_pa: Array,
    tip_m: Array,
    apart_s: float = AVERAGED_S,
    settled_pa: float = SETTLED_PA,
) -> bool:
    """Whether measured pressures (samples, ...) and tip (samples, 3) have come to rest at the end.

    Means over the last swing and over one ``apart_s`` before it; pressures that differ by more than
    ``settled_pa`` have not. What was not measured does not count.
    """
    late = time_s > time_s[-1] - AVERAGED_S
    before_s = time_s + apart_s
    before = (before_s > time_s[-1] - AVERAGED_S) & (before_s <= time_s[-1])
    if time_s[-1] - time_s[0] < 0.95 * (AVERAGED_S + apart_s):
        return False
    limits = ((measured_pa.reshape(len(time_s), -1), settled_pa), (tip_m, _SETTLED_M))
    return not any(
        np.any(np.abs(_mean(values[late]) - _mean(values[before])) > limit)
        for values, limit in limits
    )


def _mean(rows: Array) -> Array:
    """Mean of the rows that are finite; NaN where there is none."""
    seen = rows[np.isfinite(rows).all(axis=1)]
    mean: Array = seen.mean(axis=0) if len(seen) else np.full(rows.shape[1], np.nan)
    return mean


@dataclass(frozen=True)
class Rests:
    """Where the arm stood, or moved slowly: ``last`` (rests,) sample, mean ``tip_m`` (rests, 3).

    ``rotation`` (rests, 3, 3) is the mean rotation, NaN or None where there was none. ``stretch``
    (rests,) numbers the stretch of time that a rest lies in: what is in one is near each other.
    """

    last: "np.ndarray[tuple[int], np.dtype[np.int64]]"
    tip_m: Array
    rotation: Array | None = None
    stretch: "np.ndarray[tuple[int], np.dtype[np.int64]] | None" = None


#: Of valves of which nothing is known.
_RESPONSE = Response()


def find_rests(recording: Recording, response: Response = _RESPONSE) -> Rests:
    """Find every place where the acting pressures were slow; raises CalibrationError for none.

    ``response`` is what lies between a pressure that is sent and the one that acts.
    """
    acting = acting_pa(recording, response).reshape(len(recording.time_s), -1)
    slow_pa_s = min(SLOW_PA_S, _LATE_PA / max(response.slower_lag_s, 1e-3))
    fast = np.abs(np.diff(acting, axis=0)).max(axis=1) > slow_pa_s * np.diff(recording.time_s)
    found: list[tuple[int, Array, Array, int]] = []
    borders = [0, *(np.flatnonzero(fast) + 1).tolist(), len(recording.time_s)]
    restless = 0
    for number, (start, end) in enumerate(pairwise(borders)):
        for last in _places(recording, acting, start, end):
            tip = _mean_tip(recording, last)
            if tip is None:
                continue
            if _restless(recording, acting, last):
                restless += 1
                continue
            found.append((last, *tip, number))
    if not found:
        raise CalibrationError(_restless_text(restless) if restless else _NEVER_STILL)
    ends, tips, rotations, stretch = zip(*sorted(found, key=lambda each: each[0]), strict=True)
    return Rests(np.array(ends), np.array(tips), np.array(rotations), np.array(stretch))


_NEVER_STILL = (
    "the arm was never still with its tip measured: pressures must be held, or move slowly, for "
    f"{SETTLING_S + AVERAGED_S:g} s at every place, with a tip pose not older than {_OLDEST_S:g} s"
)


def _restless_text(number: int) -> str:
    return (
        f"at none of the {number} places had the measured pressures settled: the valves are too "
        "slow, or a chamber leaks; let the arm rest longer at every place"
    )


def _places(recording: Recording, acting: Array, start: int, end: int) -> list[int]:
    """Samples at which places of a slow stretch end: the last one, and those apart from it."""
    time_s = recording.time_s
    last, found = end - 1, list[int]()
    while time_s[last] - time_s[start] >= SETTLING_S + AVERAGED_S:
        if not found or np.abs(acting[last] - acting[found[-1]]).max() > _APART_PA:
            found.append(last)
        last = int(np.searchsorted(time_s, time_s[last] - AVERAGED_S, side="right")) - 1
    return found


def _window(recording: Recording, last: int) -> slice:
    first = np.searchsorted(recording.time_s, recording.time_s[last] - AVERAGED_S, side="right")
    return slice(int(first), last + 1)


def _mean_tip(recording: Recording, last: int) -> tuple[Array, Array] | None:
    """Mean tip and rotation of the time that ends at a sample, None where it was not measured."""
    window = _window(recording, last)
    tips = recording.tip_m[window]
    seen = np.isfinite(tips).all(axis=1)
    if 2 * seen.sum() <= len(tips):
        return None
    rotation = np.full((3, 3), np.nan)
    if recording.tip_rotation is not None:
        turned = recording.tip_rotation[window][seen]
        turned = turned[np.isfinite(turned).all(axis=(1, 2))]
        if len(turned):
            left, _, right = np.linalg.svd(turned.mean(axis=0))
            rotation = left @ right
    return tips[seen].mean(axis=0), rotation


def _restless(recording: Recording, acting: Array, last: int) -> bool:
    """Whether the measured pressures still went where those that act had stopped."""
    window = _window(recording, last)
    measured = recording.measured_pa.reshape(len(acting), -1)[window] - acting[window]
    half = len(measured) // 2
    if half < 2:
        return False
    change = np.abs(_mean(measured[half:]) - _mean(measured[:half]))
    return bool(np.any(change > _RESTLESS_PA))

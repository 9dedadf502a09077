"""What a calibration is fitted to: pressures sent, pressures and tip measured, over time."""

from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import CalibrationError

#: Pressures that change no faster than this (Pa/s) count as still.
STILL_PA_S = 3000.0
#: The tip is averaged over this time (s) at the end of a rest: about one swing of a soft arm.
AVERAGED_S = 0.4
#: So long (s) must pressures have been still before that, for the arm to have come to rest.
SETTLING_S = 0.5
#: A measured tip pose older than this (s) is no measurement of now.
_OLDEST_S = 0.2


@dataclass(frozen=True)
class Recording:
    """Samples in the order of time, some 100 a second.

    ``time_s`` (samples,), ``sent_pa`` and ``measured_pa`` (samples, n_sections, 3) gauge, what was
    sent to the valves and what the chambers answered, ``tip_m`` (samples, 3) the measured tip
    position, NaN where there was none. The arm was vented at the first sample.
    """

    time_s: Array
    sent_pa: Array
    measured_pa: Array
    tip_m: Array

    @property
    def n_sections(self) -> int:
        """Number of sections of the arm."""
        return int(self.sent_pa.shape[1])


def fresh_tips(tip_m: Array, age_s: Array) -> Array:
    """Tip positions (samples, 3) with NaN where the measurement was too old."""
    return np.where((age_s < _OLDEST_S)[:, None], tip_m, np.nan)


@dataclass(frozen=True)
class Rests:
    """Where the arm stood still: ``last`` (rests,) sample, mean ``tip_m`` (rests, 3) before it."""

    last: "np.ndarray[tuple[int], np.dtype[np.int64]]"
    tip_m: Array


def find_rests(recording: Recording) -> Rests:
    """Find every place where pressures were still long enough; raises CalibrationError for none."""
    moved = np.abs(np.diff(recording.sent_pa.reshape(len(recording.time_s), -1), axis=0))
    moving = moved.max(axis=1) > STILL_PA_S * np.diff(recording.time_s)
    last, tips = [], []
    start = 0
    for end in [*(np.flatnonzero(moving) + 1), len(recording.time_s)]:
        tip = _mean_tip(recording, start, end)
        if tip is not None:
            last.append(end - 1)
            tips.append(tip)
        start = end
    if not last:
        raise CalibrationError(
            "the arm was never still with its tip measured: pressures must be held for "
            f"{SETTLING_S + AVERAGED_S:g} s at every place, with a tip pose not older than "
            f"{_OLDEST_S:g} s"
        )
    return Rests(np.array(last), np.array(tips))


def _mean_tip(recording: Recording, start: int, end: int) -> Array | None:
    """Mean tip at the end of a still stretch, or None where it is too short or not measured."""
    time_s = recording.time_s[start:end]
    if time_s[-1] - time_s[0] < SETTLING_S + AVERAGED_S:
        return None
    tips = recording.tip_m[start:end][time_s > time_s[-1] - AVERAGED_S]
    seen = tips[np.isfinite(tips).all(axis=1)]
    return seen.mean(axis=0) if 2 * len(seen) > len(tips) else None

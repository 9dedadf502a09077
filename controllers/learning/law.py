"""From the error of one trial to the feed-forward of the next: iterative learning control.

Bristow, Tharayil, Alleyne, "A survey of iterative learning control", IEEE Control Systems Magazine
26(3), 2006: the P-type law with a time advance and a Q-filter (their Eq. (2)), in the serial
arrangement, where what is learnt is added to what the closed loop is to follow,

    u' = Q (u + gain z^advance e)

Q has no phase and is a half at the cutoff, |Q| = 1 / (1 + (f / cutoff)^6). Trial after trial the
error becomes smaller where |Q (1 - gain T z^advance)| < 1 at every frequency (their Theorem 3), T
the arm from what is sent to its tip. The advance undoes the phase of T; where that is no longer
known, at the lowest mode and above, Q is so small that the phase does not matter.
"""

from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import LearningError

GAIN = 0.7

#: The cutoff is this share of the lowest mode: there, Q times the peak of a mode with a tenth of
#: damping, a fifth below its nominal frequency, is still below one.
_OF_THE_MODE = 0.6

#: What is advanced is a lag as well as a dead time: cutoff times advance is at most this.
_OF_THE_ADVANCE = 1.0 / 3.0

#: The longest advance (s) that is looked for, and how finely.
LONGEST_S = 1.0
_FINE_S = 0.01

#: A tip that follows at all goes along with what was sent at least so well (1: as it was sent).
_ALONG = 0.5

#: What is learnt comes and goes over this time (s) at the ends.
_FADE_S = 0.25


@dataclass(frozen=True)
class Law:
    """How the feed-forward of the next trial is found; ``offset_max_m`` bounds its norm."""

    advance_s: float
    cutoff_hz: float
    offset_max_m: float
    step_s: float

    def improved(self, offset_m: Array, error_m: Array, gain: float = GAIN) -> Array:
        """Offsets (n, 3) of the next trial, from those of this one and its error (n, 3).

        They are zero at both ends, and nowhere longer than ``offset_max_m``: all of them are made
        smaller alike, so that nothing is cut off.
        """
        n = len(offset_m)
        beyond = int(np.ceil((self.advance_s + 4.0 / self.cutoff_hz) / self.step_s))
        both = [np.pad(part, ((beyond, beyond), (0, 0)), "edge") for part in (offset_m, error_m)]
        size = len(both[0])
        frequency_hz: Array = np.fft.rfftfreq(size, self.step_s)[:, None].astype(np.float64)
        known, missing = (np.fft.rfft(part, axis=0) for part in both)
        ahead = np.exp(2j * np.pi * frequency_hz * self.advance_s)
        learnt = quietness(frequency_hz, self.cutoff_hz) * (known + gain * ahead * missing)
        offset = np.fft.irfft(learnt, size, axis=0)[beyond : beyond + n]
        return self._bounded(offset * self._fade(n)[:, None])

    def _bounded(self, offset_m: Array) -> Array:
        largest_m = float(np.linalg.norm(offset_m, axis=1).max())
        return offset_m * min(1.0, self.offset_max_m / largest_m) if largest_m > 0.0 else offset_m

    def _fade(self, n: int) -> Array:
        """Share (n,) of what is learnt: none at the ends, all of it ``_FADE_S`` from them."""
        steps = np.minimum(np.arange(n), np.arange(n)[::-1])
        share = np.clip(steps * self.step_s / _FADE_S, 0.0, 1.0)
        return share * share * (3.0 - 2.0 * share)


def quietness(frequency_hz: Array, cutoff_hz: float) -> Array:
    """Q at a frequency: 1 at rest, a half at the cutoff, next to nothing above."""
    return 1.0 / (1.0 + (frequency_hz / cutoff_hz) ** 6)


def cutoff_hz(advance_s: float, mode_hz: float, waypoint_step_s: float) -> float:
    """Frequency up to which there is something to learn: by mode, advance and waypoints."""
    highest_hz = min(_OF_THE_MODE * mode_hz, 0.25 / waypoint_step_s)
    return min(highest_hz, _OF_THE_ADVANCE / advance_s) if advance_s > 0.0 else highest_hz


def find_advance_s(sent_m: Array, tip_m: Array, step_s: float) -> float:
    """How much later the tip (n, 3) goes the way that was sent (n, 3): dead time and lag.

    It is where the two go along best. Raises LearningError where they never do.
    """
    tip = tip_m - tip_m.mean(axis=0)
    times_s = step_s * np.arange(len(sent_m))
    best, at_s = 0.0, 0.0
    for late_s in np.arange(0.0, LONGEST_S, _FINE_S).tolist():
        late = np.stack([np.interp(times_s - late_s, times_s, c) for c in sent_m.T], axis=1)
        late -= late.mean(axis=0)
        lengths = float(np.linalg.norm(late) * np.linalg.norm(tip))
        along = float((late * tip).sum()) / lengths if lengths > 0.0 else 0.0
        if along > best:
            best, at_s = along, late_s
    if best < _ALONG:
        raise LearningError(
            "the measured tip does not go along with the trajectory, so nothing can be learnt from "
            "it: look whether the trajectory moves at all, whether the arm is free, and at the "
            "axes of the motion capture"
        )
    return at_s

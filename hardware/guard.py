"""The last check before any device: range, slew, finiteness and age of a command.

It knows the arm's limits and nothing of the controller, and imports only the arm and the errors,
so that no mistake upstream can reach the air.
"""

from dataclasses import dataclass
from enum import IntFlag

import numpy as np

from controllers.arm import Arm, Array


class Intervention(IntFlag):
    """What the guard changed in a command, as bits on the wire."""

    NOTHING = 0
    RANGE = 1
    SLEW = 2
    NOT_FINITE = 4
    TOO_OLD = 8


@dataclass(frozen=True)
class Guarded:
    """Pressures (n_sections, 3) that may be sent, and what had to be changed."""

    pressures_pa: Array
    intervention: Intervention


class Guard:
    """Turns any command into one that is allowed now.

    The slew counts from the last write that the device acknowledged, :meth:`acknowledge`. Venting
    goes past the guard: it is always allowed, at any speed.
    """

    #: A command older than this many periods, or than this time, whichever is longer, is void.
    MAX_AGE_PERIODS = 3.0
    MAX_AGE_S = 0.05

    def __init__(self, arm: Arm, period_s: float) -> None:
        self._low = arm.per_chamber("pressure_min_pa")
        self._high = arm.per_chamber("pressure_max_pa")
        self._slew = arm.per_chamber("pressure_slew_max_pa_s")
        self._max_age_s = max(self.MAX_AGE_PERIODS * period_s, self.MAX_AGE_S)
        self._period_s = period_s
        self._sent = np.zeros_like(self._low)
        self._sent_at_s: float | None = None

    def check(self, pressures_pa: Array, commanded_at_s: float, now_s: float) -> Guarded:
        """Return what may be sent at ``now_s`` for a command made at ``commanded_at_s``.

        A command that is too old or of the wrong shape becomes zeros; an element that is not a
        number keeps the value last sent.
        """
        too_old = not 0.0 <= now_s - commanded_at_s <= self._max_age_s
        if too_old or pressures_pa.shape != self._low.shape:
            return Guarded(np.zeros_like(self._low), Intervention.TOO_OLD)
        largest = self._slew * self._elapsed_s(now_s)
        low, high = self._sent - largest, self._sent + largest
        allowed = np.minimum(np.maximum(pressures_pa, low), high)
        # Range last, because a device may have acknowledged a little more than the range.
        allowed = np.minimum(np.maximum(allowed, self._low), self._high)
        if (allowed == pressures_pa).all():  # never true of a NaN
            return Guarded(allowed, Intervention.NOTHING)
        return self._changed(pressures_pa, low, high)

    def _changed(self, wanted: Array, low: Array, high: Array) -> Guarded:
        """Return what may be sent instead of a command that may not, and why; slew low to high."""
        intervention = Intervention.NOTHING
        finite = np.isfinite(wanted)
        if not finite.all():
            wanted = np.where(finite, wanted, self._sent)
            intervention |= Intervention.NOT_FINITE
        in_range = np.minimum(np.maximum(wanted, self._low), self._high)
        if (in_range != wanted).any():
            intervention |= Intervention.RANGE
        slewed = np.minimum(np.maximum(in_range, low), high)
        slewed = np.minimum(np.maximum(slewed, self._low), self._high)
        if (slewed != in_range).any():
            intervention |= Intervention.SLEW
        return Guarded(slewed, intervention)

    def _elapsed_s(self, now_s: float) -> float:
        """Time since the last acknowledged write; one period before the first."""
        if self._sent_at_s is None:
            return self._period_s
        return max(0.0, now_s - self._sent_at_s)

    def acknowledge(self, pressures_pa: Array, at_s: float) -> None:
        """Remember what the device took, as the start of the next slew.

        An element that is not a number is unknown: the value before stays.
        """
        self._sent = np.where(np.isfinite(pressures_pa), pressures_pa, self._sent)
        self._sent_at_s = at_s

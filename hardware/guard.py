"""The last check before any device: range, slew, supply, finiteness and age of a command.

It knows the arm's limits and nothing of the controller, and imports only the arm and the errors,
so that no mistake upstream can reach the air.
"""

from dataclasses import dataclass
from enum import IntFlag
from math import inf

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array


class Intervention(IntFlag):
    """What the guard changed in a command, as bits on the wire."""

    NOTHING = 0
    RANGE = 1
    SLEW = 2
    NOT_FINITE = 4
    TOO_OLD = 8
    SUPPLY = 16


@dataclass(frozen=True)
class Guarded:
    """Pressures (n_sections, 3) that may be sent, and what had to be changed."""

    pressures_pa: Array
    intervention: Intervention


class Guard:
    """Turns any command into one that is allowed now.

    The slew counts from the last write that the device acknowledged, :meth:`acknowledge`, for
    ``max_elapsed_s`` at most. Venting goes past the guard: it is always allowed, at any speed.
    ``supply_flow_max_pa_s`` limits the sum of all rises in a second, for a supply that cannot feed
    every chamber at full slew.
    """

    #: A command older than this many periods, or than this time, whichever is longer, is void.
    MAX_AGE_PERIODS = 3.0
    MAX_AGE_S = 0.05

    #: However long nothing was written, a write changes by what the slew allows in this many
    #: periods at most: what was saved up in a gap would be one step.
    MAX_ELAPSED_PERIODS = 4.0

    def __init__(
        self,
        arm: Arm,
        period_s: float,
        supply_flow_max_pa_s: float = inf,
        exchange_period_s: float = 0.0,
    ) -> None:
        """Make the guard of an arm whose commands come every ``period_s``.

        ``exchange_period_s`` is the time between two writes where they come less often.
        """
        self._low = arm.per_chamber("pressure_min_pa")
        self._high = arm.per_chamber("pressure_max_pa")
        self._slew = arm.per_chamber("pressure_slew_max_pa_s")
        self._flow_max_pa_s = supply_flow_max_pa_s
        self._max_age_s = max(self.MAX_AGE_PERIODS * period_s, self.MAX_AGE_S)
        self._period_s = period_s
        self.max_elapsed_s = self.MAX_ELAPSED_PERIODS * max(period_s, exchange_period_s)
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
        finite = np.where(np.isfinite(pressures_pa), pressures_pa, self._sent)
        in_range = self._in_range(finite)
        slewed = self._slewed(in_range, now_s)
        supplied = self._supplied(slewed, now_s)
        if (supplied == pressures_pa).all():  # never true of a NaN
            return Guarded(supplied, Intervention.NOTHING)
        stages = (pressures_pa, finite, in_range, slewed, supplied)
        return Guarded(supplied, _why(stages))

    def _in_range(self, pressures_pa: Array) -> Array:
        return np.minimum(np.maximum(pressures_pa, self._low), self._high)

    def _slewed(self, wanted: Array, now_s: float) -> Array:
        """Go no further from the last acknowledged write than the slew allows by now."""
        largest = self._slew * self._elapsed_s(now_s)
        slewed = np.minimum(np.maximum(wanted, self._sent - largest), self._sent + largest)
        # Range once more, because a device may have acknowledged a little more than the range.
        return self._in_range(slewed)

    def _supplied(self, wanted: Array, now_s: float) -> Array:
        """Shorten all rises by one factor, so that every chamber goes on, and falls not at all."""
        if self._flow_max_pa_s == inf:  # the usual case, without its cost
            return wanted
        rises = np.maximum(wanted - self._sent, 0.0)
        largest, needed = self._flow_max_pa_s * self._elapsed_s(now_s), float(rises.sum())
        if not needed > largest:
            return wanted
        return self._in_range(wanted - rises * (1.0 - largest / needed))

    def _elapsed_s(self, now_s: float) -> float:
        """Time since the last acknowledged write, a few periods at most; one before the first."""
        if self._sent_at_s is None:
            return self._period_s
        return min(max(0.0, now_s - self._sent_at_s), self.max_elapsed_s)

    def acknowledge(self, pressures_pa: Array, at_s: float) -> None:
        """Remember what the device took, as the start of the next slew.

        An element that is not a number is unknown: the value before stays.
        """
        self._sent = np.where(np.isfinite(pressures_pa), pressures_pa, self._sent)
        self._sent_at_s = at_s


#: What each stage of a check may change, in their order.
_STAGES = (Intervention.NOT_FINITE, Intervention.RANGE, Intervention.SLEW, Intervention.SUPPLY)


def _why(stages: tuple[Array, ...]) -> Intervention:
    """Return the stages that changed something; NaN differs from everything."""
    intervention = Intervention.NOTHING
    for kind, before, after in zip(_STAGES, stages, stages[1:], strict=False):
        if (before != after).any():
            intervention |= kind
    return intervention

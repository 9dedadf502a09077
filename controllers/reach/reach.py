"""How the commanded arm stands to its target, and what stops it."""

from enum import IntEnum, IntFlag

import numpy as np

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import LENGTH_MARGIN_M, Arm, Array
from pneuarm.controllers.limits.limits import AT_BOUND_M, Limits


class Reach(IntEnum):
    """How the commanded arm stands to its target, numbered as on the wire."""

    NONE = 0
    MOVING = 1
    REACHED = 2
    OUT_OF_REACH = 3


class Binding(IntFlag):
    """Which limits stop the commanded arm, as bits on the wire."""

    NOTHING = 0
    LENGTH = 1
    BEND = 2
    PRESSURE = 4
    KEEP_OUT = 8


class Progress:
    """Judges a target by how its error goes down.

    Reached is what has been within the tolerance for a while: the air follows with a lag. Out of
    reach is what has not come nearer for a while, whatever the chambers do meanwhile.
    """

    def __init__(
        self, tolerance_m: float, settled_s: float, least_rate_m_s: float, stalled_s: float
    ) -> None:
        self._tolerance_m, self._settled_s = tolerance_m, settled_s
        self._least_m, self._stalled_s = least_rate_m_s * stalled_s, stalled_s
        self.start()

    def start(self) -> None:
        """Forget what was seen."""
        self._near_s = self._still_s = 0.0
        self._best_m = np.inf

    def judge(self, error_m: float, dt_s: float) -> Reach:
        """Say how it stands after another ``dt_s`` with this error."""
        if error_m <= self._tolerance_m:
            self._near_s, self._still_s = self._near_s + dt_s, 0.0
            return Reach.REACHED if self._near_s >= self._settled_s else Reach.MOVING
        self._near_s = 0.0
        self._still_s += dt_s
        if self._best_m == np.inf:
            self._best_m = error_m
        elif self._best_m - error_m >= min(self._least_m, 0.5 * self._best_m):
            self._best_m, self._still_s = error_m, 0.0
        return Reach.OUT_OF_REACH if self._still_s >= self._stalled_s else Reach.MOVING


class BindingLimits:
    """Says which limits some lengths touch."""

    def __init__(self, arm: Arm, limits: Limits) -> None:
        self._limits = limits
        self._low_m = arm.per_chamber("length_min_m") + LENGTH_MARGIN_M
        self._high_m = arm.per_chamber("length_max_m") - LENGTH_MARGIN_M
        self._pressure_map = PressureMap(arm)
        at_bound_pa = AT_BOUND_M / arm.per_chamber("lengthening_m_per_pa")
        self._low_pa = arm.per_chamber("pressure_min_pa") + at_bound_pa
        self._high_pa = arm.per_chamber("pressure_max_pa") - at_bound_pa
        self._keep_outs = bool(arm.keep_outs)

    def at(self, lengths_m: Array) -> Binding:
        """Limits of which less than AT_BOUND_M is left at lengths (n_sections, 3)."""
        binding = Binding.NOTHING
        left = np.minimum(lengths_m - self._low_m, self._high_m - lengths_m)
        if (left < AT_BOUND_M).any():
            binding |= Binding.LENGTH
        if (self._limits.bend.slack_m(lengths_m) < AT_BOUND_M).any():
            binding |= Binding.BEND
        pressures = self._pressure_map.pressures_pa(lengths_m)
        if ((pressures < self._low_pa) | (pressures > self._high_pa)).any():
            binding |= Binding.PRESSURE
        if (
            self._keep_outs
            and (
                self._limits.keep_out.left_m(lengths_m) < 2.0 * self._limits.keep_out.margin_m
            ).any()
        ):
            binding |= Binding.KEEP_OUT
        return binding

    def _at_keep_out(self, lengths_m: Array) -> bool:
        limit = self._limits.keep_out
        return bool((limit.left_m(lengths_m) < 2.0 * limit.margin_m).any())

"""The way round inside the workspace, for one section.

A straight way of the tip may end at a limit although the target is within reach, or although
another place is nearer to a target out of reach. In chamber lengths there is always a straight way:
the lengths within Eq. (4), the pressure range and the bend are a convex set, and one section's
inverse is closed. So the tip goes straight as long as it comes nearer, and then by the lengths.
"""

import math

import numpy as np

from pneuarm.controllers.actuation.pressure_map import PressureMap, length_bounds_m
from pneuarm.controllers.actuation.symbols import is_plain
from pneuarm.controllers.arm.arm import CHAMBER_ANGLES_RAD, Arm, Array
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from pneuarm.controllers.limits.limits import workspace_is_exact
from pneuarm.controllers.targets.targets import PositionTarget, Target

#: A goal counts as better than where the tip is from this much on, m.
_BETTER_M = 2e-5

#: How far the tip may be from a goal that moves, because the correction does, m.
_WANDERS_M = 3e-4

#: Pressures count as inside their range up to this much beyond it, Pa: lengths round.
_AT_RANGE_PA = 1.0

#: The tip is stuck when its error has not gone down by _LEAST_M within _PATIENCE_S.
_LEAST_M = 1e-5
_PATIENCE_S = 0.03

#: Another target, not the same one moving on, m.
_JUMP_M = 5e-3

_COS, _SIN = np.cos(CHAMBER_ANGLES_RAD).tolist(), np.sin(CHAMBER_ANGLES_RAD).tolist()


class Detour:
    """Says when to go by the lengths, and to which."""

    def __init__(self, arm: Arm) -> None:
        self._arm, self._plain = arm, is_plain(arm)
        self._pressure_map = PressureMap(arm)
        self._pressure_low = arm.per_chamber("pressure_min_pa") - _AT_RANGE_PA
        self._pressure_high = arm.per_chamber("pressure_max_pa") + _AT_RANGE_PA
        low, high = length_bounds_m(arm)
        self._low_m, self._high_m = float(low[0, 0]), float(high[0, 0])
        # A keep-out is no convex set: there the straight way of the lengths may be closed too. The
        # inverse is closed for the backbone's end, not for a tool beyond it.
        self._possible = workspace_is_exact(arm)
        self.goal_m: Array | None = None
        self.taken = False
        #: How far from its goal the tip may be for no other reason than that the goal moves.
        self.slack_m = 0.0
        self._offset_m: Array | None = None
        self._goal_error_m = self._best_m = math.inf
        self._stuck_s = 0.0
        self._position_m: Array | None = None

    def set_target(self, target: Target | None, offset_m: Array) -> None:
        """Find the goal of a new target; ``offset_m`` (3,) is what is measured beside the model."""
        if not self._possible or not isinstance(target, PositionTarget) or _moves(target):
            self.goal_m, self._position_m, self.taken = None, None, False
            return
        before, self._position_m = self._position_m, target.position_m
        moved = math.inf if before is None else math.dist(target.position_m, before)
        if not moved <= _JUMP_M:
            self.taken = False
        still = self._offset_m is None or bool((offset_m == self._offset_m).all())
        self._offset_m, self.slack_m = offset_m, 0.0 if still else _WANDERS_M
        if moved != 0.0:
            self._best_m, self._stuck_s = math.inf, 0.0
        self.goal_m = self._exact(*(target.position_m - offset_m).tolist())
        self._goal_error_m = 0.0
        if self.goal_m is None and target.nearest_lengths_m is not None:
            self.goal_m = target.nearest_lengths_m
            tip = tip_transform(self._arm, self.goal_m)[:3, 3] + offset_m
            self._goal_error_m = math.dist(tip, target.position_m)
        if self.goal_m is not None and not self._is_allowed(self.goal_m):
            self.goal_m, self.taken = None, False

    def _is_allowed(self, lengths_m: Array) -> bool:
        """Whether the pressures for them exist: the bounds of the lengths are but a box around."""
        if self._plain:
            return True
        pressures = self._pressure_map.pressures_pa(lengths_m)
        inside = (pressures >= self._pressure_low) & (pressures <= self._pressure_high)
        return bool(inside.all())

    def _exact(self, x: float, y: float, z: float) -> Array | None:
        """Lengths (1, 3) of the one arc that ends there; None where it leaves the limits."""
        rho = math.hypot(x, y)
        half = math.atan2(rho, z)
        section = self._arm.sections[0]
        if not 2.0 * half <= section.bend_max_rad or (rho == 0.0 and z <= 0.0):
            return None  # also for a NaN
        arc_length = math.hypot(rho, z) * (half / math.sin(half) if half > 0.0 else 1.0)
        bend_m = section.chamber_offset_m * (2.0 * half / rho if rho > 0.0 else 2.0 / z)
        lengths = [
            arc_length - bend_m * (x * cos + y * sin) for cos, sin in zip(_COS, _SIN, strict=True)
        ]
        inside = self._low_m <= min(lengths) and max(lengths) <= self._high_m
        return np.array([lengths]) if inside else None

    def begins(self, error_m: float, dt_s: float, stalled: bool) -> bool:
        """Say whether to begin the detour now, with this error of the tip.

        ``stalled`` says that the tip comes nearer too slowly to wait for it.
        """
        if self.goal_m is None or self.taken:
            return False
        self._stuck_s += dt_s
        if self._best_m - error_m >= _LEAST_M or self._best_m == math.inf:
            self._best_m, self._stuck_s = error_m, 0.0
        stuck = stalled or self._stuck_s >= _PATIENCE_S
        self.taken = stuck and error_m > self._goal_error_m + _BETTER_M + self.slack_m
        return self.taken


def _moves(target: PositionTarget) -> bool:
    """A position on its way is followed with its velocity, which a detour knows nothing of."""
    return target.velocity_m_s is not None and any(target.velocity_m_s.tolist())

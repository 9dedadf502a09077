"""Reach of an arm with several sections, by search: numerical, not exact.

With more lengths than coordinates a position has no single inverse. A library of random
configurations gives the starts nearest to the target, and the QP law of the controller walks from
each of them, in steps of a few centimetres, until it is there or comes to rest. So a "reachable"
carries its proof, lengths within all limits; an "out of reach" is what no start could refute.
"""

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array, Response
from pneuarm.controllers.kinematics.compiled import CompiledKinematics
from pneuarm.controllers.kinematics.constant_curvature import (
    lengths_from_shapes,
    shapes_from_lengths,
    tip_transform,
)
from pneuarm.controllers.laws.commanded_chambers import CommandedChambers
from pneuarm.controllers.limits.limit import AT_BOUND_M
from pneuarm.controllers.targets.position import PositionTarget
from pneuarm.controllers.workspace.reachability import LimitNames, Reachability
from pneuarm.controllers.workspace.region import folded, unfolded
from pneuarm.controllers.workspace.support import Support, wedge_directions

#: A search that ends this close (m) to its target has reached it.
SEARCH_TOLERANCE_M = 1e-5

_LIBRARY = 40_000
_STARTS = 4
_STEP_M = 0.05  # largest change of a chamber in one step
_QUICK: dict[str, Any] = {
    "length_rate_max_m_s": _STEP_M,
    "length_acceleration_max_m_s2": 1e3,
    "pressure_slew_max_pa_s": 1e9,
}
_NO_LAG = Response(filling_lag_s=0.0, exhausting_lag_s=0.0)
_STEPS = 80
_DIRECTIONS, _OUTER_STARTS = 1500, 2
_RESTS_M = 2e-6  # a tip that moves less in one step is at rest


def random_configurations(arm: Arm, count: int, rng: np.random.Generator) -> Array:
    """Lengths ``(count, n_sections, 3)`` within all limits; what bends too far is unbent.

    Half are uniform in the box of the lengths, half are drawn toward its faces.
    """
    low, high = length_bounds_m(arm)
    share = rng.uniform(size=(count, arm.n_sections, 3))
    share[::2] = rng.beta(0.3, 0.3, size=share[::2].shape)
    shapes = shapes_from_lengths(low + share * (high - low), arm.per_section("chamber_offset_m"))
    theta = np.hypot(shapes[..., 1:2], shapes[..., 2:3])
    shapes[..., 1:] *= np.minimum(1.0, arm.per_section("bend_max_rad") / np.maximum(theta, 1e-12))
    lengths = lengths_from_shapes(shapes, arm.per_section("chamber_offset_m"))
    return np.clip(lengths, low, high)


class SearchedRegion:
    """Positions that the tip of an arm of any number of sections can take, found by search."""

    def __init__(self, arm: Arm, seed: int = 0) -> None:
        self.tolerance_m = SEARCH_TOLERANCE_M
        self.limits = LimitNames(arm)
        self._arm = arm
        self.library_m = random_configurations(arm, _LIBRARY, np.random.default_rng(seed))
        self.tips_m = tip_transform(arm, self.library_m)[..., :3, 3]
        self._tree = cKDTree(self.tips_m)
        self._kinematics = CompiledKinematics(arm)
        # In a search the only rate limit is the length of its steps.
        quick = tuple(replace(section, **_QUICK) for section in arm.sections)
        self._chambers = CommandedChambers(replace(arm, sections=quick, response=_NO_LAG))

    def contains(self, positions_m: Array) -> NDArray[np.bool_]:
        """Membership of positions ``(..., 3)``, one search each."""
        flat = positions_m.reshape(-1, 3)
        reached = [self.search(position)[1] <= self.tolerance_m for position in flat]
        return np.array(reached, dtype=bool).reshape(positions_m.shape[:-1])

    def nearest(self, position_m: Array) -> Reachability:
        """Answer for a position (3,); the distance is an upper bound of the true one."""
        inside, turn, side = folded(position_m)
        lengths, distance = self.search(inside)
        if distance > self.tolerance_m:
            again = self._from_boundary(inside)
            lengths, distance = min((lengths, distance), again, key=lambda pair: pair[1])
        if distance <= self.tolerance_m:
            return Reachability(True, 0, position_m.copy(), 0.0)
        limits = self.limits.within(lengths, AT_BOUND_M)
        return Reachability(False, limits, unfolded(self.tip_m(lengths), turn, side), distance)

    def tip_m(self, lengths_m: Array) -> Array:
        """Position (3,) of the tip with lengths ``(n_sections, 3)``."""
        return self._kinematics.evaluate(lengths_m).position_m.copy()

    def search(self, position_m: Array, starts: int = _STARTS) -> tuple[Array, float]:
        """Lengths ``(n_sections, 3)`` that bring the tip nearest to a position, and how near."""
        _, indices = self._tree.query(position_m, k=starts)
        found = []
        for index in np.atleast_1d(indices):
            found.append(self._walk(position_m, self.library_m[index]))
            if found[-1][1] <= self.tolerance_m:
                return found[-1]
        return min(found, key=lambda pair: pair[1])

    @cached_property
    def _furthest(self) -> tuple[Array, cKDTree]:
        """Lengths that reach furthest in many directions of the wedge, and a tree of their tips.

        It takes a second or two, and only targets out of reach need it.
        """
        lengths, tips, _ = Support(self._arm).furthest(wedge_directions(_DIRECTIONS))
        return np.clip(lengths, self.limits.lower_m, self.limits.upper_m), cKDTree(tips)

    def _from_boundary(self, position_m: Array) -> tuple[Array, float]:
        """Search from the outermost configurations, for a position folded into the wedge.

        The walks from the library may rest in a fold of the boundary.
        """
        lengths, tree = self._furthest
        _, indices = tree.query(position_m, k=_OUTER_STARTS)
        return min((self._walk(position_m, lengths[i]) for i in indices), key=lambda pair: pair[1])

    def _walk(self, position_m: Array, lengths_m: Array) -> tuple[Array, float]:
        """Follow the QP law to the target; return the best lengths on the way and the distance."""
        chambers = self._chambers
        chambers.place(lengths_m)
        chambers.ask(PositionTarget(position_m, posture_weight=0.0), 1.0, 2.0 * _STEP_M)
        chambers.place_tip()
        best, least = lengths_m, chambers.error_m
        for _ in range(_STEPS):
            before = chambers.tip.position_m.copy()
            chambers.step(chambers.qp_ik, 1.0)
            if chambers.error_m < least:
                best, least = chambers.lengths_m, chambers.error_m
            moved = float(np.abs(chambers.tip.position_m - before).max())
            if least <= self.tolerance_m or moved < _RESTS_M:
                break
        return best, least

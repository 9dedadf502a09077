"""The workspace of an arm: which positions its tip can take, and the nearest one to any other.

Under Eq. (4), the pressure range through the map, the bend limit, and the geometric constraint
between the chambers (three lengths, one arc): the same set in which the controller keeps its
commands. For one section everything is exact; for several a search answers, see
:mod:`pneuarm.controllers.workspace.search`.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import lengths_from_shapes, section_inverse
from pneuarm.controllers.limits.length import LengthLimit
from pneuarm.controllers.limits.limit import AT_BOUND_M
from pneuarm.controllers.limits.limits import Limits
from pneuarm.controllers.workspace.nearest import BoundarySearch
from pneuarm.controllers.workspace.reachability import LimitNames, Reachability, checked_positions
from pneuarm.controllers.workspace.region import ROUNDING_M, SectionRegion
from pneuarm.controllers.workspace.search import SearchedRegion


class Region(Protocol):
    """What answers for one kind of arm; positions are checked already."""

    def contains(self, positions_m: Array) -> NDArray[np.bool_]:
        """Membership of positions ``(..., 3)``."""
        ...

    def nearest(self, position_m: Array) -> Reachability:
        """Answer for a position (3,)."""
        ...


class SolvedRegion:
    """One section, by the exact inverse and the search over its boundary."""

    def __init__(self, arm: Arm) -> None:
        self.region = SectionRegion(arm)
        self.boundary = BoundarySearch(self.region)

    def contains(self, positions_m: Array) -> NDArray[np.bool_]:
        """Membership of positions ``(..., 3)``, exact."""
        return self.region.contains(positions_m)

    def nearest(self, position_m: Array) -> Reachability:
        """Answer for a position (3,)."""
        if self.region.contains(position_m):
            return Reachability(True, 0, position_m.copy(), 0.0)
        nearest = self.boundary.nearest_m(position_m)
        limits = self.region.limits.within(self._lengths_m(nearest), AT_BOUND_M)
        distance = float(np.linalg.norm(position_m - nearest))
        return Reachability(False, limits, nearest, distance)

    def exceeded(self, position_m: Array) -> int:
        """Bits of the limits that the one arc to a position exceeds; length where no arc ends."""
        if position_m[0] == position_m[1] == 0.0 and position_m[2] <= 0.0:
            return LengthLimit.bit
        return self.region.limits.within(self._lengths_m(position_m), -ROUNDING_M)

    def _lengths_m(self, position_m: Array) -> Array:
        return lengths_from_shapes(section_inverse(position_m), self.region.offset_m)[None]


class Workspace:
    """The positions that the tip of an arm can take.

    ``exact`` is True for one section. For several sections a position counts as reachable when a
    search came within SEARCH_TOLERANCE_M of it: "reachable" is then certain to that tolerance,
    "out of reach" means that no start of the search got there.
    """

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.limits = LimitNames(arm)
        self.exact = arm.n_sections == 1
        self.region: SolvedRegion | SearchedRegion = (
            SolvedRegion(arm) if self.exact else SearchedRegion(arm)
        )

    def is_reachable(self, position_m: object) -> Reachability:
        """Say whether the tip can be at ``position_m`` (3,) in the base frame, and else how near.

        Raises InvalidInput for a wrong shape or a coordinate that is not finite.
        """
        return self.region.nearest(checked_positions(position_m, single=True))

    def contains(self, positions_m: object) -> NDArray[np.bool_]:
        """Say for positions ``(..., 3)`` whether the tip can be there; raises InvalidInput."""
        return self.region.contains(checked_positions(positions_m, single=False))

    def lengths_m(self, position_m: Array) -> Array:
        """Lengths (1, 3) of one section whose tip is at a reachable position (3,), within limits.

        Raises InvalidInput for an arm of several sections: there a position has many.
        """
        if not isinstance(self.region, SolvedRegion):
            raise InvalidInput(f"arm {self.arm.name!r} has {self.arm.n_sections} sections, not 1")
        exact = lengths_from_shapes(section_inverse(position_m), self.region.region.offset_m)
        return Limits(self.arm).clip(exact[None])

"""A point of the backbone at a position."""

import math
from dataclasses import dataclass, replace
from typing import Self

import casadi as ca
import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import TargetRejected
from pneuarm.controllers.kinematics.compiled import symbolic_tip
from pneuarm.controllers.targets import checks
from pneuarm.controllers.targets.target import LawName, Target
from pneuarm.controllers.tasks.rows import Block, Parts, block
from pneuarm.controllers.tasks.wanted import Wanted


@dataclass(frozen=True)
class PointTarget(Target):
    """Bring the backbone's point at ``station`` to ``position_m`` (3,) in the base frame.

    The station counts sections: 0 is the base, 1 the tip, 0.5 of an arm with two sections is the
    plate between them. The correction of the tip does not apply here.
    """

    name, kind = "point", 7
    parts = {"point_m": 3, "point_weight": 1, "station": 1}

    position_m: Array
    station: float
    law: LawName = LawName.DEFAULT
    weight: float = 1.0

    @classmethod
    def checked(cls, fields: checks.Fields, allowed: checks.Allowed, law: LawName) -> Self:
        """A station of the backbone, and a position that the backbone up to it can have."""
        checks.required(fields, "position_m")
        station: float = fields["station"]
        if not 0.0 < station <= 1.0:  # never true of a NaN
            raise TargetRejected(
                f"station = {station:g}; allowed: above 0 (the base) to 1 (the tip)"
            )
        position, arm = allowed.position(fields), allowed.arm
        shares = np.clip(station * arm.n_sections - np.arange(arm.n_sections), 0.0, 1.0)
        longest = float(shares @ arm.per_section("length_max_m")[:, 0])
        distance = math.hypot(*position)
        if distance > longest:
            raise TargetRejected(
                f"position_m = {checks.listed(position)} is {distance:.3g} m from the base, but "
                f"the backbone at station {station:g} reaches at most {longest:.3g} m"
            )
        return cls(position, station, law)

    def write(self, wanted: Wanted) -> None:
        """Three rows of its own."""
        wanted["point_m"], wanted["station"] = self.position_m, self.station
        wanted["point_weight"], wanted["posture_weight"] = self.weight, 1.0

    @classmethod
    def rows(cls, arm: Arm, lengths: ca.SX, want: Parts) -> Block:
        """Offset (3,) of the point from where it should be, and its Jacobian."""
        along = arm.n_sections * want["station"]
        shares = [ca.fmin(ca.fmax(along - index, 0.0), 1.0) for index in range(arm.n_sections)]
        position, _, jacobian = symbolic_tip(arm, lengths, shares)
        error = want["point_m"] - position
        return block(want["point_weight"], error, ca.SX(3, 1), jacobian[:3, :])

    def weighted(self, weight: float, orientation_weight: float) -> "PointTarget":
        """One weight."""
        return replace(self, weight=weight)

    def sets(self) -> frozenset[str]:
        """Itself; at station 1 it is the tip."""
        return frozenset({"point", "position"} if self.station == 1.0 else {"point"})

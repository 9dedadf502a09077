"""The tip at a position and in an orientation."""

from dataclasses import dataclass, replace
from typing import Self

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.geometry.rotations import rotation_from_quaternion
from pneuarm.controllers.targets import checks
from pneuarm.controllers.targets.target import LawName, Target
from pneuarm.controllers.tasks.wanted import Wanted


@dataclass(frozen=True)
class PoseTarget(Target):
    """Tip at ``position_m`` (3,) in the orientation ``quaternion_xyzw`` (4,), a unit quaternion.

    An arm of one section has three degrees of freedom: where both cannot be had the result is
    the weighted compromise of the least squares; a radian weighs as much as ORIENTATION_LENGTH_M.
    """

    name, kind = "pose", 2

    position_m: Array
    quaternion_xyzw: Array
    law: LawName = LawName.DEFAULT
    weight: float = 1.0
    orientation_weight: float = 1.0

    @classmethod
    def checked(cls, fields: checks.Fields, allowed: checks.Allowed, law: LawName) -> Self:
        """Position in the base frame, unit quaternion."""
        checks.required(fields, "position_m")
        checks.required(fields, "orientation")
        return cls(allowed.position(fields), checks.quaternion(fields, "orientation"), law)

    def write(self, wanted: Wanted) -> None:
        """Six rows."""
        wanted["position_m"], wanted["position_weight"] = self.position_m, self.weight
        wanted["rotation"] = rotation_from_quaternion(self.quaternion_xyzw)
        wanted["orientation_weight"] = self.orientation_weight
        wanted["position_follows"] = wanted["rotation_follows"] = 1.0
        wanted["posture_weight"] = 1.0

    def weighted(self, weight: float, orientation_weight: float) -> "PoseTarget":
        """Position and orientation may weigh differently."""
        return replace(self, weight=weight, orientation_weight=orientation_weight)

    def sets(self) -> frozenset[str]:
        """Both the position and where the tip points."""
        return frozenset({"position", "direction"})

    def goal(self) -> tuple[Array | None, Array | None]:
        """Return position and orientation."""
        return self.position_m, self.quaternion_xyzw

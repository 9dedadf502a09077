"""Where the tip points."""

from dataclasses import dataclass, replace
from typing import Self

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.targets import checks
from pneuarm.controllers.targets.target import LawName, Target
from pneuarm.controllers.tasks.wanted import Wanted


@dataclass(frozen=True)
class DirectionTarget(Target):
    """The tip's z axis along ``direction`` (3,), a unit vector; roll and position are free."""

    name, kind = "direction", 6

    direction: Array
    law: LawName = LawName.DEFAULT
    weight: float = 1.0

    @classmethod
    def checked(cls, fields: checks.Fields, allowed: checks.Allowed, law: LawName) -> Self:
        """A vector of some length in the base frame."""
        checks.check_frame(fields, ("base",))
        return cls(checks.unit_vector(fields, "direction"), law)

    def write(self, wanted: Wanted) -> None:
        """Three rows, of which the one about the tip's own axis is empty."""
        wanted["direction"], wanted["direction_follows"] = self.direction, 1.0
        wanted["orientation_weight"], wanted["posture_weight"] = self.weight, 1.0

    def weighted(self, weight: float, orientation_weight: float) -> "DirectionTarget":
        """One weight."""
        return replace(self, weight=weight)

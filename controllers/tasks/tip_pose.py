"""The tip at a position and in an orientation."""

from dataclasses import dataclass

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.tasks.wanted import Wanted


@dataclass(frozen=True)
class TipPose:
    """Bring the tip to a pose in the base frame: position (3,) and rotation (3, 3).

    An arm of one section has three degrees of freedom: where both cannot be had the result is
    the weighted compromise of the least squares; a radian weighs as much as ORIENTATION_LENGTH_M.
    """

    position_m: Array
    rotation: Array
    position_weight: float = 1.0
    orientation_weight: float = 1.0

    def write(self, wanted: Wanted) -> None:
        """Six rows."""
        wanted["position_m"], wanted["position_weight"] = self.position_m, self.position_weight
        wanted["rotation"], wanted["orientation_weight"] = self.rotation, self.orientation_weight
        wanted["position_follows"] = wanted["rotation_follows"] = 1.0
        wanted["posture_weight"] = 1.0

"""Where the tip points."""

from dataclasses import dataclass

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.tasks.wanted import Wanted


@dataclass(frozen=True)
class TipDirection:
    """Let the tip's z axis point along ``direction`` (3,), a unit vector in the base frame.

    It may roll about it.
    """

    direction: Array
    weight: float = 1.0

    def write(self, wanted: Wanted) -> None:
        """Three rows, of which the one about the tip's own axis is empty."""
        wanted["direction"], wanted["direction_follows"] = self.direction, 1.0
        wanted["orientation_weight"], wanted["posture_weight"] = self.weight, 1.0

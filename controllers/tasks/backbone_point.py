"""A point of the backbone at a position."""

from dataclasses import dataclass

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.tasks.wanted import Wanted


@dataclass(frozen=True)
class BackbonePoint:
    """Bring the backbone's point at ``station`` to ``position_m`` (3,) in the base frame.

    The station counts sections: 0 is the base, 1 the tip, 0.5 of an arm with two sections is the
    plate between them. The correction of the tip does not apply here.
    """

    position_m: Array
    station: float
    weight: float = 1.0

    def write(self, wanted: Wanted) -> None:
        """Three rows."""
        wanted["point_m"], wanted["station"] = self.position_m, self.station
        wanted["point_weight"], wanted["posture_weight"] = self.weight, 1.0

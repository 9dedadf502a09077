"""The tip at a position."""

from dataclasses import dataclass

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.tasks.wanted import Wanted


@dataclass(frozen=True)
class TipPosition:
    """Bring the tip to ``position_m`` (3,) in the base frame, by proportional feedback.

    ``velocity_m_s`` (3,) is how the position itself moves: it is added to the feedback, so that a
    moving position is followed without lag. What the position leaves free goes to the posture.
    """

    position_m: Array
    velocity_m_s: Array | None = None
    weight: float = 1.0
    posture_weight: float = 1.0

    def write(self, wanted: Wanted) -> None:
        """Three rows."""
        wanted["position_m"] = self.position_m
        wanted["velocity_m_s"] = 0.0 if self.velocity_m_s is None else self.velocity_m_s
        wanted["position_weight"], wanted["position_follows"] = self.weight, 1.0
        wanted["posture_weight"] = self.posture_weight

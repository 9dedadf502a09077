"""The tip at a position."""

from dataclasses import dataclass

import numpy as np

from controllers.arm import Array
from controllers.kinematics.compiled import TipState
from controllers.tasks.task import limited


@dataclass(frozen=True)
class TipPosition:
    """Bring the tip to ``position_m`` (3,) in the base frame, by proportional feedback.

    ``velocity_m_s`` (3,) is that of the position itself, added to the feedback.
    """

    position_m: Array
    gain_per_s: float
    speed_max_m_s: float
    velocity_m_s: Array | None = None

    def rate_and_jacobian(self, tip: TipState, lengths_m: Array) -> tuple[Array, Array]:
        """Velocity toward the position, at most ``speed_max_m_s``, and the linear Jacobian."""
        velocity = self.gain_per_s * (self.position_m - tip.position_m)
        if self.velocity_m_s is not None:
            velocity += self.velocity_m_s
        return limited(velocity, self.speed_max_m_s), tip.jacobian[:3]

    def error_m(self, tip: TipState, lengths_m: Array) -> float:
        """Distance from the tip to the position."""
        offset = self.position_m - tip.position_m
        return float(np.sqrt(offset @ offset))

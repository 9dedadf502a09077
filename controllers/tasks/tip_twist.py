"""The tip moving with a twist."""

from dataclasses import dataclass

import numpy as np

from controllers.arm import Array
from controllers.kinematics.compiled import TipState
from controllers.tasks.tip_pose import ORIENTATION_LENGTH_M


@dataclass(frozen=True)
class TipTwist:
    """Move the tip body with a twist.

    ``linear_m_s`` (3,) is the velocity of the body's point that lies at the reference point: the
    tip itself, or the origin of the base (a spatial twist). Both vectors are expressed in the
    frame, base or tip. Without ``angular_rad_s`` only the linear part is asked for.
    """

    linear_m_s: Array
    angular_rad_s: Array | None
    in_tip_frame: bool
    about_base_origin: bool

    def rate_and_jacobian(self, tip: TipState, lengths_m: Array) -> tuple[Array, Array]:
        """Linear rows, and angular rows scaled to metres when an angular part was given."""
        turn = tip.rotation if self.in_tip_frame else np.eye(3)
        linear = turn @ self.linear_m_s
        if self.angular_rad_s is None:
            return linear, tip.jacobian[:3]
        angular = turn @ self.angular_rad_s
        if self.about_base_origin:
            linear = linear + np.cross(angular, tip.position_m)
        rate = np.concatenate([linear, ORIENTATION_LENGTH_M * angular])
        return rate, np.vstack([tip.jacobian[:3], ORIENTATION_LENGTH_M * tip.jacobian[3:]])

    def error_m(self, tip: TipState, lengths_m: Array) -> float:
        """Return 0: a twist has no end."""
        return 0.0

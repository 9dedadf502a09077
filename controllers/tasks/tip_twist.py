"""The tip moving with a twist."""

from dataclasses import dataclass

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.tasks.wanted import Wanted


@dataclass(frozen=True)
class TipTwist:
    """Move the tip body with a twist.

    ``linear_m_s`` (3,) is the velocity of the body's point that lies at the reference point: the
    tip itself, or the origin of the base (a spatial twist). Both vectors are expressed in the
    frame, base or tip. Without ``angular_rad_s`` only the linear part is asked for. An arm of one
    section has three degrees of freedom: all of them go to the linear part.
    """

    linear_m_s: Array
    angular_rad_s: Array | None
    in_tip_frame: bool
    about_base_origin: bool

    def write(self, wanted: Wanted) -> None:
        """Three rows, and three more where an angular part was given and can be had."""
        wanted["velocity_m_s"], wanted["position_weight"] = self.linear_m_s, 1.0
        wanted["in_tip_frame"] = self.in_tip_frame
        wanted["posture_weight"] = 1.0
        if self.angular_rad_s is not None:
            wanted["angular_rad_s"] = self.angular_rad_s
            wanted["about_base_origin"] = self.about_base_origin
            wanted["orientation_weight"] = float(wanted["lengths_m"].size > 3)

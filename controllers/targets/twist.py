"""The tip moving with a twist."""

from dataclasses import dataclass
from typing import Self

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import TargetRejected
from pneuarm.controllers.targets import checks
from pneuarm.controllers.targets.target import LawName, Target
from pneuarm.controllers.tasks.wanted import Wanted


@dataclass(frozen=True)
class TwistTarget(Target):
    """Move the tip body with a twist, without end.

    ``linear_m_s`` (3,) is the velocity of the body's point that lies at the reference point: the
    tip itself, or the origin of the base (a spatial twist). Both vectors are expressed in the
    frame, base or tip. Without ``angular_rad_s`` only the linear part is asked for. An arm of one
    section has three degrees of freedom: all of them go to the linear part.
    """

    name, kind = "twist", 3
    default_law, has_end = LawName.RESOLVED_RATE, False

    linear_m_s: Array
    angular_rad_s: Array | None
    in_tip_frame: bool
    about_base_origin: bool
    law: LawName = LawName.DEFAULT

    @classmethod
    def checked(cls, fields: checks.Fields, allowed: checks.Allowed, law: LawName) -> Self:
        """Frame and reference point that go together, velocities that an arm can have."""
        in_tip_frame = checks.check_frame(fields, ("base", "tip")) == "tip"
        point = fields["reference_point"]
        if point not in ("base", "tip"):
            raise TargetRejected(f"reference_point = {point!r}; allowed: 'base', 'tip'")
        linear = checks.rate(fields, "linear_m_s", checks.FASTEST_M_S, "m/s", "mm/s")
        angular = None
        if fields["angular_rad_s"] is not None:
            angular = checks.rate(fields, "angular_rad_s", checks.FASTEST_RAD_S, "rad/s", "degrees")
        if point == "base" and angular is None:
            raise TargetRejected("reference_point = 'base' needs angular_rad_s as well")
        if point == "base" and in_tip_frame:
            raise TargetRejected("frame_id = 'tip' goes with reference_point = 'tip' only")
        return cls(linear, angular, in_tip_frame, point == "base", law)

    def write(self, wanted: Wanted) -> None:
        """Three rows, and three more where an angular part was given and can be had."""
        wanted["velocity_m_s"], wanted["position_weight"] = self.linear_m_s, 1.0
        wanted["in_tip_frame"] = self.in_tip_frame
        wanted["posture_weight"] = 1.0
        if self.angular_rad_s is not None:
            wanted["angular_rad_s"] = self.angular_rad_s
            wanted["about_base_origin"] = self.about_base_origin
            wanted["orientation_weight"] = float(wanted["lengths_m"].size > 3)

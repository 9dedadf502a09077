"""What a configuration may tell the controller."""

from dataclasses import dataclass

from pneuarm.controllers.targets.targets import LawName


@dataclass(frozen=True)
class ControlSettings:
    """Gains and tolerances of the laws."""

    default_law: LawName = LawName.QP_IK
    gain_per_s: float = 30.0
    tip_speed_max_m_s: float = 0.3
    reached_tolerance_m: float = 5e-4
    settled_time_s: float = 0.3
    stalled_rate_m_s: float = 5e-4
    stalled_time_s: float = 0.2

"""The loop and the laws."""

from typing import Annotated, Literal

from pydantic import Field

from pneuarm.controllers.laws.settings import ControlSettings
from pneuarm.controllers.targets.targets import LawName
from pneuarm.hardware.tables.table import MM, Positive, Table


class ControlConfig(Table):
    """The loop and the laws."""

    rate_hz: Annotated[float, Field(ge=50, le=2000)] = 1000.0
    law: Literal["resolved_rate", "qp_ik"] = "qp_ik"
    gain_per_s: Annotated[float, Field(gt=0, le=200)] = 30.0
    tip_speed_max_mm_s: Positive = 400.0
    reached_tolerance_mm: Positive = 0.5
    target_timeout_ms: Annotated[float, Field(ge=20, le=5000)] = 200.0
    arming_timeout_s: Annotated[float, Field(ge=1, le=600)] = 30.0
    hold_timeout_s: Annotated[float, Field(ge=1, le=3600)] = 60.0
    lease_timeout_s: Annotated[float, Field(ge=0.5, le=600)] = 5.0
    spin_us: Annotated[float, Field(ge=0, le=1000)] = 120.0
    priority: Annotated[int, Field(ge=1, le=98)] = 80

    def settings(self) -> ControlSettings:
        """Return what the laws need, in SI units."""
        return ControlSettings(
            default_law=LawName[self.law.upper()],
            gain_per_s=self.gain_per_s,
            tip_speed_max_m_s=self.tip_speed_max_mm_s * MM,
            reached_tolerance_m=self.reached_tolerance_mm * MM,
        )

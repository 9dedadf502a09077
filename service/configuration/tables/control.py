"""The loop and the laws."""

from typing import Annotated, Literal

from pydantic import Field

from pneuarm.controllers.laws.settings import ControlSettings
from pneuarm.controllers.targets.targets import LawName
from pneuarm.hardware.tables.table import MM, Positive, Table


class ControlConfig(Table):
    """The loop and the laws."""

    rate_hz: Annotated[
        float, Field(ge=50, le=2000, description="ticks a second (`trunk` sets 500)")
    ] = 1000.0
    law: Annotated[
        Literal["resolved_rate", "qp_ik"],
        Field(
            description=(
                "law of targets that name none; a twist that names none is followed by resolved "
                "rate"
            )
        ),
    ] = "qp_ik"
    gain_per_s: Annotated[
        float,
        Field(gt=0, le=200, description="proportional gain from the error to the wanted rate"),
    ] = 30.0
    tip_speed_max_mm_s: Annotated[
        Positive, Field(description="largest commanded tip speed toward a position or pose")
    ] = 400.0
    reached_tolerance_mm: Annotated[
        Positive,
        Field(
            description=(
                "a target is reached when the commanded arm has been this near for 0.3 s; while a "
                "measured tip corrects the arm, the estimated tip must be as near to its reference"
            )
        ),
    ] = 0.5
    target_timeout_ms: Annotated[
        float,
        Field(
            ge=20,
            le=5000,
            description=(
                "a target older than this makes the arm hold; a target that answers to a state "
                "older than this is refused"
            ),
        ),
    ] = 200.0
    arming_timeout_s: Annotated[
        float, Field(ge=1, le=600, description="active without any target for this long: hold")
    ] = 30.0
    hold_timeout_s: Annotated[
        float,
        Field(
            ge=1, le=3600, description="holding for this long while nobody holds the lease: vent"
        ),
    ] = 60.0
    lease_timeout_s: Annotated[
        float,
        Field(
            ge=0.5,
            le=600,
            description="a lease holder not heard for this long may be replaced without take-over",
        ),
    ] = 5.0
    spin_us: Annotated[
        float,
        Field(
            ge=0,
            le=1000,
            description=(
                "the loop sleeps until this long before a deadline and spins the rest; 0 sleeps all"
                " the way"
            ),
        ),
    ] = 120.0
    priority: Annotated[
        int,
        Field(
            ge=1,
            le=98,
            description="real-time priority asked for; the daemon says whether it was granted",
        ),
    ] = 80

    def settings(self) -> ControlSettings:
        """Return what the laws need, in SI units."""
        return ControlSettings(
            default_law=LawName[self.law.upper()],
            gain_per_s=self.gain_per_s,
            tip_speed_max_m_s=self.tip_speed_max_mm_s * MM,
            reached_tolerance_m=self.reached_tolerance_mm * MM,
        )

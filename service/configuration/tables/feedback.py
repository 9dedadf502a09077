"""The reference between targets, and the correction by the measured tip."""

from typing import Annotated

from pydantic import Field

from pneuarm.controllers.feedback.observer import FeedbackSettings
from pneuarm.controllers.reference.trajectory import ReferenceLimits
from pneuarm.service.configuration.tables.table import MM, Positive, Table

_MBAR = 100.0


class ReferenceConfig(Table):
    """How fast the reference goes to a target."""

    speed_max_mm_s: Annotated[float, Field(gt=0, le=5000)] = 500.0
    acceleration_max_mm_s2: Annotated[float, Field(gt=0, le=100000)] = 2000.0
    jerk_max_mm_s3: Annotated[float, Field(gt=0, le=10000000)] = 20000.0

    def limits(self) -> ReferenceLimits:
        """Return the limits in SI units."""
        return ReferenceLimits(
            self.speed_max_mm_s * MM, self.acceleration_max_mm_s2 * MM, self.jerk_max_mm_s3 * MM
        )


class FeedbackConfig(Table):
    """The correction by the measured tip, and when a measurement is believed."""

    enabled: bool = True
    camera_delay_ms: Annotated[float, Field(ge=0, le=300)] = 10.0
    camera_timeout_ms: Annotated[float, Field(ge=20, le=5000)] = 100.0
    time_constant_ms: Annotated[float, Field(ge=20, le=10000)] = 170.0
    rate_max_mm_s: Positive = 50.0
    deadband_mm: Annotated[float, Field(ge=0, le=5)] = 0.1
    jump_max_mm: Positive = 20.0
    jump_accept_s: Annotated[float, Field(gt=0, le=60)] = 0.5
    model_sigma_mm: Positive = 25.0
    length_sigma_mm: Positive = 10.0
    dither_mbar: Annotated[float, Field(ge=0, le=100)] = 15.0
    dither_period_ms: Annotated[float, Field(ge=4, le=1000)] = 30.0
    hysteresis_share: Annotated[float, Field(ge=0, le=1)] = 0.55
    hysteresis_share_moving: Annotated[float, Field(ge=0, le=1)] = 0.65
    tip_pose_source: Annotated[
        str,
        Field(
            max_length=64,
            pattern=r"^[A-Za-z0-9_.-]*$",
            description="the one publisher whose measured tip poses are taken, under the key "
            "`sensor/tip_pose/<tip_pose_source>`; empty takes the first that publishes, and warns",
        ),
    ] = ""
    tip_pose_key_file: Annotated[
        str,
        Field(
            description="file with a secret of 16 bytes or more; each pose must then have the "
            "HMAC-SHA256 of its payload attached, and a stamp that increases; empty: no signature"
        ),
    ] = ""

    def settings(self) -> FeedbackSettings:
        """Return them in SI units."""
        return FeedbackSettings(
            enabled=self.enabled,
            delay_s=self.camera_delay_ms * 1e-3,
            timeout_s=self.camera_timeout_ms * 1e-3,
            time_constant_s=self.time_constant_ms * 1e-3,
            rate_max_m_s=self.rate_max_mm_s * MM,
            deadband_m=self.deadband_mm * MM,
            jump_max_m=self.jump_max_mm * MM,
            jump_accept_s=self.jump_accept_s,
            model_sigma_m=self.model_sigma_mm * MM,
            length_sigma_m=self.length_sigma_mm * MM,
            dither_pa=self.dither_mbar * _MBAR,
            dither_period_s=self.dither_period_ms * 1e-3,
            hysteresis_share=self.hysteresis_share,
            hysteresis_share_moving=self.hysteresis_share_moving,
        )

"""The reference between targets, and the correction by the measured tip."""

import math
from typing import Annotated

from pydantic import Field

from pneuarm.controllers.feedback.observer import FeedbackSettings
from pneuarm.controllers.reference.trajectory import ReferenceLimits
from pneuarm.hardware.tables.table import MM, PathText, Positive, Table

_MBAR = 100.0


class ReferenceConfig(Table):
    """How fast the reference goes to a target."""

    speed_max_mm_s: Annotated[
        float,
        Field(
            gt=0,
            le=5000,
            description="largest speed of the reference; an axis gets it over the root of three",
        ),
    ] = 500.0
    acceleration_max_mm_s2: Annotated[
        float, Field(gt=0, le=100000, description="largest acceleration, likewise")
    ] = 2000.0
    jerk_max_mm_s3: Annotated[
        float,
        Field(gt=0, le=10000000, description="largest jerk, likewise; lower swings the arm less"),
    ] = 20000.0

    def limits(self) -> ReferenceLimits:
        """Return the limits in SI units."""
        return ReferenceLimits(
            self.speed_max_mm_s * MM, self.acceleration_max_mm_s2 * MM, self.jerk_max_mm_s3 * MM
        )


class FeedbackConfig(Table):
    """The correction by the measured tip, and when a measurement is believed."""

    enabled: Annotated[
        bool,
        Field(
            description="whether `sensor/tip_pose` corrects the arm; it is estimated with it anyway"
        ),
    ] = True
    camera_delay_ms: Annotated[
        float, Field(ge=0, le=300, description="age of a tip pose when it arrives")
    ] = 10.0
    camera_timeout_ms: Annotated[
        float,
        Field(ge=20, le=5000, description="without a pose for this long the camera counts as lost"),
    ] = 100.0
    time_constant_ms: Annotated[
        float,
        Field(
            ge=20,
            le=10000,
            description=(
                "how fast the correction follows the measured difference; twice as fast while the "
                "tip stands still, and never faster than twice what lies between a correction and "
                "the pose that shows it: dead time and lag of the valves behind their lead, age "
                "and pause of the poses"
            ),
        ),
    ] = 170.0
    rate_max_mm_s: Annotated[Positive, Field(description="how fast the correction may change")] = (
        50.0
    )
    deadband_mm: Annotated[
        float, Field(ge=0, le=5, description="a smaller difference changes nothing")
    ] = 0.1
    jump_max_mm: Annotated[
        Positive, Field(description="a pose that is further off the ones before is refused")
    ] = 20.0
    jump_accept_s: Annotated[
        float,
        Field(gt=0, le=60, description="poses that stay there, and agree, for this long are taken"),
    ] = 0.5
    offset_max_share: Annotated[
        float,
        Field(
            gt=0,
            le=1,
            description="largest correction of the position, as a share of the arm's length; what "
            "is measured beyond is held there and told (`correction_limited`)",
        ),
    ] = 0.25
    turn_max_deg: Annotated[
        float,
        Field(
            gt=0,
            le=180,
            description="largest correction of the orientation; a pose that is turned further "
            "changes it no more",
        ),
    ] = 45.0
    learned_max_share: Annotated[
        float,
        Field(
            gt=0,
            le=1,
            description="largest offset of the tip that `pneuarm learn` may learn, and that a "
            "trajectory may be sent with, as a share of the arm's length",
        ),
    ] = 0.2
    still_max_mm: Annotated[
        Positive,
        Field(
            description="where the model's tip moves this far and the measured one does not go "
            "along, no pose is believed until it does (`tip_pose_not_along`)"
        ),
    ] = 10.0
    model_sigma_mm: Annotated[
        Positive,
        Field(description="standard deviation of the tip where nothing but pressures is measured"),
    ] = 25.0
    length_sigma_mm: Annotated[
        Positive, Field(description="the same where every chamber has a length sensor")
    ] = 10.0
    dither_mbar: Annotated[
        float,
        Field(
            ge=0,
            le=100,
            description=(
                "swing of the setpoints against stiction and resolution of the valves, while a "
                "measured tip is followed; 0 is none"
            ),
        ),
    ] = 15.0
    dither_period_ms: Annotated[
        float,
        Field(
            ge=4,
            le=1000,
            description=(
                "its period; four times the swing in a period must stay well below "
                "`pressure_slew_max_bar_s`"
            ),
        ),
    ] = 30.0
    hysteresis_share: Annotated[
        float,
        Field(
            ge=0,
            le=1,
            description=(
                "share of the calibrated hysteresis that is inverted while a measured tip is "
                "followed and the reference stands; a calibrated loop holds that of the valves too,"
                " which the dither takes away"
            ),
        ),
    ] = 0.55
    hysteresis_share_moving: Annotated[
        float,
        Field(
            ge=0,
            le=1,
            description=(
                "the same while the reference moves at 60 mm/s or faster; in between it grows with "
                "the speed"
            ),
        ),
    ] = 0.65

    tip_pose_source: Annotated[
        str,
        Field(
            max_length=64,
            pattern=r"^[A-Za-z0-9_.-]*$",
            description="the one publisher whose tip poses are taken, under the key "
            "`sensor/tip_pose/<tip_pose_source>`; empty: the first that publishes, with a warning",
        ),
    ] = ""
    tip_pose_key_file: Annotated[
        PathText,
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
            offset_max_share=self.offset_max_share,
            turn_max_rad=math.radians(self.turn_max_deg),
            still_max_m=self.still_max_mm * MM,
            model_sigma_m=self.model_sigma_mm * MM,
            length_sigma_m=self.length_sigma_mm * MM,
            dither_pa=self.dither_mbar * _MBAR,
            dither_period_s=self.dither_period_ms * 1e-3,
            hysteresis_share=self.hysteresis_share,
            hysteresis_share_moving=self.hysteresis_share_moving,
        )

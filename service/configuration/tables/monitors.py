"""The thresholds of the monitors, and the ramp of a fault."""

from typing import Annotated

from pydantic import Field

from pneuarm.hardware.tables.table import BAR, MM, Table
from pneuarm.service.configuration.monitor_settings import MonitorSettings

MS = 1e-3


class MonitorsConfig(Table):
    """When something counts as a fault: how much of it, and for how long."""

    deviation_bar: Annotated[
        float,
        Field(
            gt=0,
            allow_inf_nan=False,
            description=(
                "how far a pressure may be from the one expected: the pressure sent, through "
                "`delay_ms` and `lag_ms` of `[arm.response]`; in a move half of "
                "what the valve has still to go is allowed besides"
            ),
        ),
    ] = 0.1
    deviation_ms: Annotated[float, Field(ge=0, le=10000, description="for how long")] = 300.0
    vent_timeout_s: Annotated[
        float,
        Field(
            gt=0,
            le=600,
            description=(
                "for how long while vented: how fast a chamber empties is a matter of its tubes"
            ),
        ),
    ] = 3.0
    leak_bar: Annotated[
        float,
        Field(
            gt=0,
            allow_inf_nan=False,
            description="how much of a held pressure may be lost",
        ),
    ] = 0.03
    leak_ms: Annotated[float, Field(ge=0, le=10000, description="for how long")] = 300.0
    supply_margin_bar: Annotated[
        float,
        Field(
            ge=0,
            le=10,
            description="how far the supply must be above the highest `pressure_max_bar`",
        ),
    ] = 0.2
    supply_ms: Annotated[
        float,
        Field(
            ge=0,
            le=10000,
            description="for how long it may be below",
        ),
    ] = 500.0
    length_tolerance_mm: Annotated[
        float,
        Field(
            gt=0,
            allow_inf_nan=False,
            description="how far a measured chamber length may be from the model's",
        ),
    ] = 60.0
    tip_tolerance_percent: Annotated[
        float,
        Field(
            gt=0,
            allow_inf_nan=False,
            description=(
                "how far a measured tip may be from the model's, in percent of the arm's length "
                "at rest"
            ),
        ),
    ] = 75.0
    model_ms: Annotated[float, Field(ge=0, le=10000, description="for how long either")] = 500.0
    frozen_bar: Annotated[
        float,
        Field(
            gt=0,
            allow_inf_nan=False,
            description=(
                "how far the expected pressure may move while the reading repeats itself bit by bit"
            ),
        ),
    ] = 0.05
    frozen_ms: Annotated[float, Field(ge=0, le=10000, description="for how long")] = 200.0
    sensor_margin_bar: Annotated[
        float,
        Field(
            gt=0,
            allow_inf_nan=False,
            description=(
                "a reading this far outside the arm's pressures, or not a number, is a broken "
                "sensor"
            ),
        ),
    ] = 1.0
    sensor_ms: Annotated[float, Field(ge=0, le=10000, description="for how long")] = 50.0
    overpressure_bar: Annotated[
        float,
        Field(
            gt=0,
            allow_inf_nan=False,
            description="how far a measured pressure may be above its chamber's `pressure_max_bar`",
        ),
    ] = 0.15
    overpressure_ms: Annotated[float, Field(ge=0, le=10000, description="for how long")] = 20.0
    measurement_age_ms: Annotated[
        float,
        Field(
            ge=10,
            le=10000,
            description="how old a measurement may be",
        ),
    ] = 150.0
    device_lost_ms: Annotated[
        float,
        Field(
            ge=10,
            le=10000,
            description="a measurement older than this is a device that is lost",
        ),
    ] = 1000.0
    overrun_percent: Annotated[
        float,
        Field(
            gt=0,
            le=100,
            description="how many deadlines the loop may miss in a second",
        ),
    ] = 5.0
    estimate_margin_mm: Annotated[
        float,
        Field(
            gt=0,
            allow_inf_nan=False,
            description="how far an estimated length may be outside Eq. (4)'s interval",
        ),
    ] = 30.0
    estimate_ms: Annotated[float, Field(ge=0, le=10000, description="for how long")] = 100.0
    setpoint_bar: Annotated[
        float,
        Field(
            gt=0,
            allow_inf_nan=False,
            description="how far the device's setpoint may be from ours",
        ),
    ] = 0.03
    setpoint_ms: Annotated[
        float,
        Field(
            ge=0,
            le=10000,
            description="for how long: above the time that a setpoint takes to the device and back",
        ),
    ] = 500.0
    ramp_bar_s: Annotated[
        float,
        Field(
            gt=0,
            allow_inf_nan=False,
            description=(
                "how fast pressures go to zero after a fault that ramps; never faster than "
                "`pressure_slew_max_bar_s`"
            ),
        ),
    ] = 1.0

    def settings(self) -> MonitorSettings:
        """Return the thresholds in SI units."""
        return MonitorSettings(
            deviation_pa=self.deviation_bar * BAR,
            deviation_s=self.deviation_ms * MS,
            vent_timeout_s=self.vent_timeout_s,
            leak_pa=self.leak_bar * BAR,
            leak_s=self.leak_ms * MS,
            supply_margin_pa=self.supply_margin_bar * BAR,
            supply_s=self.supply_ms * MS,
            length_tolerance_m=self.length_tolerance_mm * MM,
            tip_tolerance_fraction=0.01 * self.tip_tolerance_percent,
            model_s=self.model_ms * MS,
            frozen_pa=self.frozen_bar * BAR,
            frozen_s=self.frozen_ms * MS,
            sensor_margin_pa=self.sensor_margin_bar * BAR,
            sensor_s=self.sensor_ms * MS,
            overpressure_pa=self.overpressure_bar * BAR,
            overpressure_s=self.overpressure_ms * MS,
            measurement_age_s=self.measurement_age_ms * MS,
            device_lost_s=self.device_lost_ms * MS,
            overrun_fraction=0.01 * self.overrun_percent,
            estimate_margin_m=self.estimate_margin_mm * MM,
            estimate_s=self.estimate_ms * MS,
            setpoint_pa=self.setpoint_bar * BAR,
            setpoint_s=self.setpoint_ms * MS,
            ramp_pa_s=self.ramp_bar_s * BAR,
        )

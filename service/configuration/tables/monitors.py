"""The thresholds of the monitors, and the ramp of a fault."""

from typing import Annotated

from pydantic import Field

from pneuarm.service.configuration.monitor_settings import MonitorSettings
from pneuarm.service.configuration.tables.table import BAR, MM, Positive, Table

MS = 1e-3

Lasting = Annotated[float, Field(ge=0, le=10000)]


class MonitorsConfig(Table):
    """When something counts as a fault: how much of it, and for how long."""

    deviation_bar: Positive = 0.1
    deviation_ms: Lasting = 300.0
    vent_timeout_s: Annotated[float, Field(gt=0, le=600)] = 3.0
    leak_bar: Positive = 0.03
    leak_ms: Lasting = 300.0
    supply_margin_bar: Annotated[float, Field(ge=0, le=10)] = 0.2
    supply_ms: Lasting = 500.0
    length_tolerance_mm: Positive = 60.0
    tip_tolerance_percent: Positive = 75.0
    model_ms: Lasting = 500.0
    frozen_bar: Positive = 0.05
    frozen_ms: Lasting = 200.0
    sensor_margin_bar: Positive = 1.0
    sensor_ms: Lasting = 50.0
    overpressure_bar: Positive = 0.15
    overpressure_ms: Lasting = 20.0
    measurement_age_ms: Annotated[float, Field(ge=10, le=10000)] = 150.0
    device_lost_ms: Annotated[float, Field(ge=10, le=10000)] = 1000.0
    overrun_percent: Annotated[float, Field(gt=0, le=100)] = 5.0
    estimate_margin_mm: Positive = 30.0
    estimate_ms: Lasting = 100.0
    setpoint_bar: Positive = 0.03
    setpoint_ms: Lasting = 500.0
    ramp_bar_s: Positive = 1.0

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

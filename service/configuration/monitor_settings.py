"""The thresholds of the monitors in SI units; their defaults are in tables/monitors.py."""

from dataclasses import dataclass


@dataclass(frozen=True)
class MonitorSettings:
    """See docs/configuration.md, ``[monitors]``, for what each means."""

    deviation_pa: float
    deviation_s: float
    vent_timeout_s: float
    leak_pa: float
    leak_s: float
    supply_margin_pa: float
    supply_s: float
    length_tolerance_m: float
    tip_tolerance_fraction: float
    model_s: float
    frozen_pa: float
    frozen_s: float
    sensor_margin_pa: float
    sensor_s: float
    overpressure_pa: float
    overpressure_s: float
    measurement_age_s: float
    device_lost_s: float
    overrun_fraction: float
    estimate_margin_m: float
    estimate_s: float
    setpoint_pa: float
    setpoint_s: float
    ramp_pa_s: float

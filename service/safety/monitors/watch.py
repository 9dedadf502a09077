"""All monitors of an arm, looked through once a tick."""

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.hardware.interface import Measurement
from pneuarm.service.configuration.monitor_settings import MonitorSettings
from pneuarm.service.modes.mode import VENTED_MODES, Mode
from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.age import Age
from pneuarm.service.safety.monitors.device import Complaints, StopInput
from pneuarm.service.safety.monitors.estimate import Estimate
from pneuarm.service.safety.monitors.frozen import Frozen
from pneuarm.service.safety.monitors.lag import Lag
from pneuarm.service.safety.monitors.leak import Leak
from pneuarm.service.safety.monitors.model_holds import ModelHolds
from pneuarm.service.safety.monitors.monitor import Monitor, Observation
from pneuarm.service.safety.monitors.overpressure import Overpressure
from pneuarm.service.safety.monitors.overruns import Overruns
from pneuarm.service.safety.monitors.pressure_follows import PressureFollows
from pneuarm.service.safety.monitors.sensor_range import SensorRange
from pneuarm.service.safety.monitors.setpoint import Setpoint
from pneuarm.service.safety.monitors.supply import Supply


def always(settings: MonitorSettings) -> tuple[Monitor, ...]:
    """Return the monitors that look however old the measurement is."""
    return (
        StopInput(),
        Age(FaultCode.DEVICE_LOST, settings.device_lost_s),
        Age(FaultCode.MEASUREMENT_OLD, settings.measurement_age_s),
        Overruns(settings.overrun_fraction),
        Complaints(),
    )


def of_fresh(arm: Arm, settings: MonitorSettings) -> tuple[Monitor, ...]:
    """Return the monitors that compare a measurement with the present, so it must be fresh."""
    highest_pa = float(arm.per_chamber("pressure_max_pa").max())
    tip_m = settings.tip_tolerance_fraction * arm.total_rest_length_m
    return (
        Overpressure(arm, settings.overpressure_pa, settings.overpressure_s),
        SensorRange(arm, settings.sensor_margin_pa, settings.sensor_s),
        Frozen(settings.frozen_pa, settings.frozen_s),
        PressureFollows(settings.deviation_pa, settings.deviation_s, settings.vent_timeout_s),
        Setpoint(settings.setpoint_pa, settings.setpoint_s),
        Leak(settings.leak_pa, settings.leak_s),
        Supply(highest_pa + settings.supply_margin_pa, settings.supply_s),
        Estimate(arm, settings.estimate_margin_m, settings.estimate_s),
        ModelHolds(arm, settings.length_tolerance_m, tip_m, settings.model_s),
    )


def measurement_age_s(measurement: Measurement, now_s: float) -> float:
    """How old a measurement is; one taken while the tick was already due counts as new."""
    return 0.0 if measurement.taken_s is None else max(0.0, now_s - measurement.taken_s)


class Watch:
    """The monitors, and the prediction they share."""

    def __init__(self, arm: Arm, settings: MonitorSettings) -> None:
        self._always = always(settings)
        self._all = (*self._always, *of_fresh(arm, settings))
        self._fresh_s = settings.measurement_age_s
        self._lag = Lag(arm.response)

    def look(
        self,
        measurement: Measurement,
        sent_pa: Array,
        estimated_m: Array,
        tip_error_m: float,
        mode: Mode,
        now_s: float,
        dt_s: float,
        overruns: int,
    ) -> dict[FaultCode, str]:
        """Return every fault that is there now, with what was seen.

        ``sent_pa`` is what the device last acknowledged, ``estimated_m`` of the tick before, both
        (n_sections, 3).
        """
        measured = measurement.pressures_pa.ravel().tolist()
        # Before its first acknowledgement a device has not been told anything but zero.
        sent = [value if value == value else 0.0 for value in sent_pa.ravel().tolist()]
        setpoints = measurement.setpoints_pa
        seen = Observation(
            now_s=now_s,
            dt_s=dt_s,
            mode=mode,
            vented=mode in VENTED_MODES,
            measured_pa=measured,
            sent_pa=sent,
            expected_pa=self._lag.advance(sent, measured, dt_s),
            age_s=measurement_age_s(measurement, now_s),
            supply_pa=measurement.supply_pa,
            setpoints_pa=None if setpoints is None else setpoints.ravel().tolist(),
            lengths_m=measurement.lengths_m.ravel().tolist(),
            estimated_m=estimated_m.ravel().tolist(),
            tip_error_m=tip_error_m,
            overruns=overruns,
            complaints=measurement.complaints,
            stop_pressed=measurement.stop_pressed,
        )
        found: dict[FaultCode, str] = {}
        for monitor in self._all if seen.age_s <= self._fresh_s else self._always:
            what = monitor.look(seen)
            if what:
                found[monitor.code] = what
        return found

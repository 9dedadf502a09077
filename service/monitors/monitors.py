"""The list of the monitors, what they look at, and one look through all of them."""

from collections import deque
from collections.abc import Mapping

from pneuarm.controllers.arm.arm import Arm, Array, Response
from pneuarm.hardware.interface import Measurement
from pneuarm.hardware.tables.table import Table
from pneuarm.service.modes.mode import VENTED_MODES, Mode
from pneuarm.service.monitors.device import DeviceComplains, StopPressed
from pneuarm.service.monitors.estimate_diverges import EstimateDiverges
from pneuarm.service.monitors.fault import Fault
from pneuarm.service.monitors.leak import Leak
from pneuarm.service.monitors.loop_overruns import LoopOverruns
from pneuarm.service.monitors.measurement_age import (
    DeviceLost,
    MeasurementOld,
    measurement_age_s,
)
from pneuarm.service.monitors.model_contradicted import ModelContradicted
from pneuarm.service.monitors.monitor import Monitor, Observation
from pneuarm.service.monitors.overpressure import Overpressure
from pneuarm.service.monitors.pressure_deviates import PressureDeviates
from pneuarm.service.monitors.sensor_frozen import SensorFrozen
from pneuarm.service.monitors.sensor_invalid import SensorInvalid
from pneuarm.service.monitors.setpoint_foreign import SetpointForeign
from pneuarm.service.monitors.supply_low import SupplyLow

#: Every monitor, in the order in which they look, tell and change the mode.
MONITORS: tuple[type[Monitor], ...] = (
    StopPressed,
    DeviceLost,
    MeasurementOld,
    LoopOverruns,
    DeviceComplains,
    Overpressure,
    SensorInvalid,
    SensorFrozen,
    PressureDeviates,
    SetpointForeign,
    Leak,
    SupplyLow,
    EstimateDiverges,
    ModelContradicted,
)


class Lag:
    """What the pressures should be by now: dead time and lags of :class:`Response`.

    Exact over steps; from the first measurement on.
    """

    def __init__(self, response: Response) -> None:
        self._response = response
        self._now_s = 0.0
        self._acting: list[float] = []
        self._newest: list[float] = []
        self._pending: deque[tuple[float, list[float]]] = deque()
        self.expected_pa: list[float] = []

    def advance(self, sent_pa: list[float], measured_pa: list[float], dt_s: float) -> list[float]:
        """Let ``dt_s`` pass under ``sent_pa``; return what is expected now."""
        if not self.expected_pa:
            # A pressure that is not known yet counts as vented.
            self.expected_pa = [value if value == value else 0.0 for value in measured_pa]
            self._acting = self._newest = sent_pa
            return self.expected_pa
        if sent_pa != self._newest:
            self._newest = sent_pa
            self._pending.append((self._now_s + self._response.delay_s, sent_pa))
        until_s = self._now_s + dt_s
        while self._pending and self._pending[0][0] <= until_s:
            due_s, setpoints = self._pending.popleft()
            self._relax_to(due_s)
            self._acting = setpoints
        self._relax_to(until_s)
        return self.expected_pa

    def _relax_to(self, time_s: float) -> None:
        passed_s, self._now_s = time_s - self._now_s, time_s
        if passed_s <= 0.0:
            return
        filling, exhausting = self._response.left(passed_s)
        self.expected_pa = [
            acting + (filling if acting > expected else exhausting) * (expected - acting)
            for acting, expected in zip(self._acting, self.expected_pa, strict=True)
        ]


class Monitors:
    """The monitors of an arm, and the prediction they share.

    ``keys`` has the configured table of each monitor that has keys, by the code of its fault.
    """

    def __init__(self, arm: Arm, keys: Mapping[str, Table]) -> None:
        made = [kind(arm, keys.get(kind.fault.code)) for kind in MONITORS]
        self._of_any_age = [monitor for monitor in made if not monitor.needs_fresh]
        self._of_fresh = [monitor for monitor in made if monitor.needs_fresh]
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
    ) -> dict[Fault, str]:
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
        found: dict[Fault, str] = {}
        _look(self._of_any_age, seen, found)
        if MeasurementOld.fault not in found:
            _look(self._of_fresh, seen, found)
        return found


def _look(monitors: list[Monitor], seen: Observation, found: dict[Fault, str]) -> None:
    for monitor in monitors:
        what = monitor.look(seen)
        if what:
            found[monitor.fault] = what

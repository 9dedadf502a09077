"""Valves that let air through an orifice: from a supply into a chamber, and out of it.

The flow is that of ISO 6358-1:2013, by the sonic conductance C and the critical pressure ratio b of
an orifice, from the absolute pressure p_1 before it to p_2 behind it:

    m = C rho_0 p_1                                         choked, p_2 / p_1 <= b
    m = C rho_0 p_1 sqrt(1 - ((p_2 / p_1 - b) / (1 - b))^2)   else

A chamber of volume V has the temperature of the reference atmosphere (isothermal), whose pressure
p_0 is rho_0 R T_0 = 100 kPa. So V dp/dt = R T_0 m, and C rho_0 becomes C p_0.
"""

from math import exp, sqrt

import numpy as np

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.simulator.parameters import (
    FlowParameters,
    RegulatorParameters,
    SimulatorParameters,
    SwitchingParameters,
)
from pneuarm.hardware.simulator.pneumatics import Valve

AMBIENT_PA = 101_325.0
_REFERENCE_PA = 1e5


def flowed_pa(
    pressure_pa: float, source_pa: float, exchange: float, critical_ratio: float
) -> float:
    """Absolute pressure of a chamber after a while in which it was open to a source.

    ``source_pa`` is the source's absolute pressure, higher or lower: no air flows once the
    chamber has it. ``exchange`` is C p_0 / V times the while, which must be small against 1.
    """
    before_pa, after_pa = max(pressure_pa, source_pa), min(pressure_pa, source_pa)
    passed_pa, ratio = exchange * before_pa, after_pa / before_pa
    if ratio > critical_ratio:
        passed_pa *= sqrt(1.0 - ((ratio - critical_ratio) / (1.0 - critical_ratio)) ** 2)
    if source_pa > pressure_pa:
        return min(pressure_pa + passed_pa, source_pa)
    return max(pressure_pa - passed_pa, source_pa)


class FlowValve(Valve):
    """A regulator a chamber, which opens in proportion to its error, and fully at a large one.

    Small errors therefore decay with the time constant while a chamber fills with choked flow;
    large ones take as long as the orifice needs. The supply stands above the arm's largest
    pressure. A chamber that may be evacuated exhausts to a vacuum half way between its lowest
    pressure and none, any other to ambient. To be advanced in steps of at most 2.5 ms.
    """

    def __init__(self, arm: Arm, values: FlowParameters) -> None:
        super().__init__(arm, values)
        per_volume = _REFERENCE_PA / values.valve_volume_m3
        self._filling_per_s = values.valve_filling_conductance_m3_s_pa * per_volume
        self._exhausting_per_s = values.valve_exhausting_conductance_m3_s_pa * per_volume
        self._critical_ratio = values.valve_critical_pressure_ratio
        highest_pa = float(arm.per_chamber("pressure_max_pa").max())
        self._supply_pa = AMBIENT_PA + highest_pa + values.valve_supply_margin_pa
        lowest_pa = arm.per_chamber("pressure_min_pa").reshape(-1)
        vacuum_pa = 0.5 * (AMBIENT_PA + lowest_pa)
        self._sinks_pa = np.where(lowest_pa < 0.0, vacuum_pa, AMBIENT_PA).tolist()
        self._ambient_pa = [AMBIENT_PA] * arm.n_chambers
        #: The error at which a valve is fully open.
        self._band_pa = values.valve_time_constant_s * self._filling_per_s * self._supply_pa

    def _wanted(self) -> list[float]:
        """Share of the opening that each chamber's error asks for: above 0 to fill."""
        if self._is_venting:
            return [-1.0] * len(self._sinks_pa)
        error = ((self._play.output - self.pressures_pa) / self._band_pa).reshape(-1).tolist()
        return [min(max(share, -1.0), 1.0) for share in error]

    def _let_flow(self, open_s: list[float]) -> None:
        """Let air through the valves, fully open for so long each: above 0 to fill."""
        supply_pa, ratio = self._supply_pa, self._critical_ratio
        filling_per_s, exhausting_per_s = self._filling_per_s, self._exhausting_per_s
        sinks_pa = self._ambient_pa if self._is_venting else self._sinks_pa
        before_pa = (self.pressures_pa + AMBIENT_PA).reshape(-1).tolist()
        after_pa = [
            flowed_pa(pressure_pa, supply_pa, time_s * filling_per_s, ratio)
            if time_s > 0.0
            else flowed_pa(pressure_pa, sink_pa, -time_s * exhausting_per_s, ratio)
            for pressure_pa, sink_pa, time_s in zip(before_pa, sinks_pa, open_s, strict=True)
        ]
        self.pressures_pa = np.array(after_pa).reshape(self.pressures_pa.shape) - AMBIENT_PA


class RegulatorValve(FlowValve):
    """A regulator that opens by degrees, with a lag, which is long for exhausting.

    Its pilot has to be filled or bled first. It closes at once.
    """

    def __init__(self, arm: Arm, values: RegulatorParameters) -> None:
        super().__init__(arm, values)
        self._filling_opening_s = values.valve_filling_opening_s
        self._exhausting_opening_s = values.valve_exhausting_opening_s
        self._openings = [0.0] * arm.n_chambers

    def _relax(self, duration_s: float) -> None:
        if duration_s <= 0.0:
            return
        filling_rest = exp(-duration_s / self._filling_opening_s)
        exhausting_rest = exp(-duration_s / self._exhausting_opening_s)
        self._openings = [
            _moved(now, wanted, filling_rest if wanted > 0.0 else exhausting_rest)
            for now, wanted in zip(self._openings, self._wanted(), strict=True)
        ]
        self._let_flow([duration_s * opening for opening in self._openings])


def _moved(now: float, wanted: float, rest: float) -> float:
    """Opening after a step in which a lag leaves ``rest`` of what it has still to open."""
    if now * wanted < 0.0:
        now = 0.0
    return wanted if abs(wanted) <= abs(now) else wanted + rest * (now - wanted)


class SwitchingValve(FlowValve):
    """A valve to fill and one to exhaust, each either open or shut.

    One of them is open from the start of each period, for the share that the error asks for then.
    """

    def __init__(self, arm: Arm, values: SwitchingParameters) -> None:
        super().__init__(arm, values)
        self._period_s = 1.0 / values.valve_pwm_hz
        self._left_s = 0.0
        self._open_s = [0.0] * arm.n_chambers

    def _relax(self, duration_s: float) -> None:
        if self._is_venting and duration_s > 0.0:
            self._left_s = 0.0  # what follows begins with a period of its own
            self._let_flow([-duration_s] * len(self._open_s))
            return
        while duration_s > 0.0:
            if self._left_s <= 0.0:
                self._left_s = self._period_s
                self._open_s = [self._period_s * share for share in self._wanted()]
            step_s = min(duration_s, self._left_s)
            now_s = [min(max(open_s, -step_s), step_s) for open_s in self._open_s]
            self._open_s = [
                all_s - part_s for all_s, part_s in zip(self._open_s, now_s, strict=True)
            ]
            if any(now_s):
                self._let_flow(now_s)
            self._left_s -= step_s
            duration_s -= step_s


def valve_of(arm: Arm, values: SimulatorParameters) -> Valve:
    """Make the valves that an arm's parameters are those of; vented."""
    if isinstance(values, RegulatorParameters):
        return RegulatorValve(arm, values)
    if isinstance(values, SwitchingParameters):
        return SwitchingValve(arm, values)
    return Valve(arm, values)

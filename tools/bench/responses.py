"""What a calibration says of valves and mode, beside what the simulated arm truly has.

    .venv/bin/python -m tools.bench.responses --row 450/1600/60

A row is the lags of filling and of exhausting and the dead time (ms) of valves of first order, or
`itv` or `onoff`. The configuration says 60/60/5 throughout, as that of a laboratory that has
measured nothing. Valves that are no lags of first order have no lag to compare: the times in which
a step takes 63 % of its way stand beside dead time and lag that were found.
"""

import argparse
from dataclasses import replace
from math import exp
from typing import get_args

import numpy as np

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import CalibrationError
from pneuarm.controllers.calibration.calibrate import calibrate
from pneuarm.hardware.simulator.adapter import SimulatedArm
from pneuarm.hardware.simulator.flow_valves import valve_of
from pneuarm.hardware.simulator.parameters import NOMINAL, SimulatorParameters, Valves
from pneuarm.hardware.simulator.pneumatics import Valve
from pneuarm.service.calibration.simulated import record_simulated
from pneuarm.service.configuration.configuration import Configuration
from tools.bench.calibrated import RATE_HZ
from tools.rig.simulated import configuration_of

ROWS = ("60/60/5", "200/600/30", "450/1600/60", "itv", "onoff")
#: Steps (Pa) whose time to 63 % is told.
_STEPS_PA = (4e3, 5e4)
_STEP_S = 2.5e-3


class LopsidedValve(Valve):
    """Valves of first order that fill and exhaust at different paces."""

    def __init__(self, arm: Arm, values: SimulatorParameters, lags_s: tuple[float, float]) -> None:
        super().__init__(arm, values)
        self._lags_s = lags_s

    def _relax(self, duration_s: float) -> None:
        if duration_s > 0.0:
            filling, exhausting = (exp(-duration_s / lag_s) for lag_s in self._lags_s)
            missing = self.pressures_pa - self._play.output
            rest = np.where(missing < 0.0, filling, exhausting)
            self.pressures_pa = self._play.output + rest * missing


class LopsidedArm(SimulatedArm):
    """A simulated arm behind such valves, whose numbers are those that are told, not drawn."""

    def __init__(
        self, arm: Arm, seed: int, filling_s: float, exhausting_s: float, delay_s: float
    ) -> None:
        super().__init__(arm, NOMINAL["servo"], seed)
        values = replace(self.drawn.values, valve_delay_s=delay_s)
        self.drawn = replace(self.drawn, values=values)
        self._lags_s = (filling_s, exhausting_s)

    def connect(self) -> None:
        """Put the arm at rest, behind its own valves."""
        super().connect()
        self._valve = LopsidedValve(self._arm, self.drawn.values, self._lags_s)


def arm_of(row: str, preset: str, seed: int) -> tuple[Configuration, SimulatedArm]:
    """Return the configuration of a laboratory that has measured nothing, and the arm it has."""
    valves: Valves = next((kind for kind in get_args(Valves) if kind == row), "servo")
    configuration = configuration_of(preset, RATE_HZ, seed, valves)
    arm = configuration.build_simulated_arm()
    if valves == row:
        return configuration, SimulatedArm(arm, NOMINAL[valves], seed)
    filling_s, exhausting_s, delay_s = (1e-3 * float(part) for part in row.split("/"))
    return configuration, LopsidedArm(arm, seed, filling_s, exhausting_s, delay_s)


def times_to_63_s(valve: Valve, step_pa: float) -> tuple[float, float]:
    """Times in which such valves fill and exhaust by 63 % of a step from rest, about 0.1 bar."""
    at = np.array([1e4, 1e4 + step_pa, 1e4])
    found, time_s = list[float](), 0.0
    for index, goal_pa in enumerate(at.tolist()):
        valve.command(np.full(valve.pressures_pa.shape, goal_pa), time_s)
        begun_s, taken_s, start_pa = time_s, np.nan, float(valve.pressures_pa[0, 0])
        for _ in range(round(12.0 / _STEP_S)):
            valve.advance(time_s, time_s + _STEP_S)
            time_s += _STEP_S
            gone = (float(valve.pressures_pa[0, 0]) - start_pa) / (goal_pa - start_pa)
            if np.isnan(taken_s) and gone > 1.0 - exp(-1.0):
                taken_s = time_s - begun_s
        found += [taken_s] if index else []
    return found[0], found[1]


def valves_of(row: str, arm: Arm, device: SimulatedArm) -> Valve:
    """Return new valves of a row, at rest and without their play, which would take of a step."""
    values = replace(device.drawn.values, valve_hysteresis_fraction=0.0, valve_resolution_pa=1.0)
    if row in get_args(Valves):
        return valve_of(arm, values)
    return LopsidedValve(arm, values, device._lags_s if isinstance(device, LopsidedArm) else (0, 0))


def _told(row: str, preset: str, seed: int) -> str:
    configuration, device = arm_of(row, preset, seed)
    arm, drawn = configuration.build_arm(), device.drawn.values
    lines = [f"{row} ({preset}, seed {seed})"]
    lines.append(f"  true: dead time {1e3 * drawn.valve_delay_s:.0f} ms")
    for step_pa in _STEPS_PA:
        filling_ms, exhausting_ms = (
            1e3 * time_s for time_s in times_to_63_s(valves_of(row, arm, device), step_pa)
        )
        lines.append(
            f"  true: to 63 % of {1e-5 * step_pa:.2f} bar filling {filling_ms:.0f} ms, exhausting "
            f"{exhausting_ms:.0f} ms"
        )
    lines.append(f"  true: mode {drawn.lowest_mode_hz:.2f} Hz, damping {drawn.damping_ratio:.2f}")
    try:
        recording = record_simulated(configuration, device)
        lines.append(f"  the motion took {recording.time_s[-1] - recording.time_s[0]:.0f} s")
        found = calibrate(arm, recording)
    except CalibrationError as error:
        return "\n".join([*lines, f"  refused: {error}"])
    response, sd = found.response.response, found.response.sd
    total = [
        1e3 * (response.delay_s + lag)
        for lag in (response.filling_lag_s, response.exhausting_lag_s)
    ]
    lines += [
        f"  found: delay {1e3 * response.delay_s:.0f} +- {1e3 * sd.delay_s:.1f} ms, filling "
        f"{1e3 * response.filling_lag_s:.0f} +- {1e3 * sd.filling_lag_s:.1f} ms, exhausting "
        f"{1e3 * response.exhausting_lag_s:.0f} +- {1e3 * sd.exhausting_lag_s:.1f} ms; in all "
        f"{total[0]:.0f} and {total[1]:.0f} ms",
        f"  found: mode {response.mode_hz:.2f} +- {sd.mode_hz:.2f} Hz, damping "
        f"{response.damping_ratio:.2f}",
        f"  said: {found.note or 'nothing'}",
    ]
    return "\n".join(lines)


def main() -> None:
    """Calibrate the arms of the rows, and print what was found beside what is true."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--preset", default="paper", choices=("paper", "table1", "trunk"))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--row", action="append", help=f"of these: {', '.join(ROWS)}, or another")
    arguments = parser.parse_args()
    for row in arguments.row or ROWS:
        print(_told(row, arguments.preset, arguments.seed), flush=True)


if __name__ == "__main__":
    main()

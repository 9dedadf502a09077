"""How much nearer the tip comes to a trajectory by repeating it: the real loop in simulated time.

    .venv/bin/python -m tools.bench.learning --json

A circle as a file of waypoints, run through as `pneuarm learn` does: the same law, the same trials,
with a camera that takes 100 poses a second, 10 ms late and with 0.1 mm of noise. The arm is not
calibrated but with `--calibrated`. Of slow valves its configuration says what a laboratory has to
say of them. The errors are those of the measured tip.
"""

import argparse
import json
import math
from typing import Any

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import LearningError
from pneuarm.controllers.learning.course import Course
from pneuarm.controllers.learning.learning import Learning, Trial
from pneuarm.controllers.targets.trajectory import TrajectoryTarget
from pneuarm.hardware.simulator.parameters import NOMINAL, Valves
from pneuarm.service.calibration.simulated import calibrate_simulated
from pneuarm.service.configuration.configuration import Configuration, check
from pneuarm.service.learning.drive import APPROACH_S, bound_m
from pneuarm.service.learning.learn import learn
from pneuarm.service.learning.recorded import measured_tip
from tools.bench.rig import CameraRig
from tools.rig.simulated import configuration_of

RATE_HZ = 250.0
RADIUS_M, HEIGHT_M, WAYPOINTS = 0.04, 0.2, 200
#: Circles (Hz) that valves of a kind are asked for.
FREQUENCIES_HZ: dict[Valves, tuple[float, ...]] = {
    "servo": (0.25, 0.5),
    "itv": (0.05, 0.1),
    "onoff": (0.25, 0.5),
}

#: What the configuration says of slow valves: dead time and lag of small steps, how far a pressure
#: may be from the one that these let expect, and a correction that is not quicker than they are.
SAID: dict[Valves, dict[str, Any]] = {
    "itv": {
        "arm": {
            "response": {"delay_ms": 30.0, "filling_lag_ms": 440.0, "exhausting_lag_ms": 1090.0}
        },
        "monitors": {"pressure_deviates": {"deviation_bar": 0.3}},
        "feedback": {"time_constant_ms": 600.0},
    },
    "onoff": {
        "arm": {
            "response": {"delay_ms": 20.0, "filling_lag_ms": 140.0, "exhausting_lag_ms": 260.0}
        },
        "monitors": {"pressure_deviates": {"deviation_bar": 0.2}},
        "feedback": {"time_constant_ms": 300.0},
    },
}
_BEYOND_S = 0.2


def arm_with(valves: Valves, seed: int, time_constant_ms: float | None = None) -> Configuration:
    """An arm of the family with a kind of valves, of which its configuration knows."""
    plain = configuration_of("paper", RATE_HZ, seed, valves)
    tables = _over(plain.model_dump(exclude_none=True), SAID.get(valves, {}))
    if time_constant_ms is not None:
        tables["feedback"] |= {"time_constant_ms": time_constant_ms}
    return check(tables, "the bench")


def _over(tables: dict[str, Any], said: dict[str, Any]) -> dict[str, Any]:
    """Tables with others laid over them."""
    laid = {
        key: _over(tables[key], value) if isinstance(value, dict) else value
        for key, value in said.items()
    }
    return tables | laid


def circle(frequency_hz: float, turns: float = 2.0, radius_m: float = RADIUS_M) -> TrajectoryTarget:
    """Waypoints of a circle that begins and ends at rest, each time within half a period."""
    ramp_s = 0.5 / frequency_hz
    end_s = turns / frequency_hz + ramp_s
    fine_s = np.linspace(0.0, end_s, 20001)
    share = np.clip(np.minimum(fine_s, end_s - fine_s) / ramp_s, 0.0, 1.0)
    rate = 2.0 * math.pi * frequency_hz * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(fine_s))])
    times_s = np.linspace(0.0, end_s, WAYPOINTS)
    at = np.interp(times_s, fine_s, angle)
    points = [(radius_m * math.cos(a), radius_m * math.sin(a), HEIGHT_M) for a in at.tolist()]
    return TrajectoryTarget(tuple(times_s.tolist()), tuple(points))


class SimulatedTrials:
    """One arm that goes through the trials of a course."""

    def __init__(self, configuration: Configuration, course: Course) -> None:
        self.rig = CameraRig(configuration).activate()
        self._configuration, self._course = configuration, course

    def follow(self, target: TrajectoryTarget) -> Array:
        """To the beginning, and along the trajectory; return the measured tip on the grid."""
        self.rig.to(np.array(target.positions_m[0]), APPROACH_S)
        self.rig.forget()
        ticks = self.rig.run(self._course.duration_s + _BEYOND_S, target)
        return measured_tip(ticks, self._course, self._configuration)


def repeated(
    configuration: Configuration, wanted: TrajectoryTarget, trials: int
) -> tuple[Learning, SimulatedTrials]:
    """Learn a trajectory on one arm."""
    course = Course(wanted)
    arm = SimulatedTrials(configuration, course)
    learning = Learning(course, bound_m(configuration), configuration.arm.response.mode_hz)
    learn(learning, trials, arm.follow)
    return learning, arm


def measure(
    configuration: Configuration, frequency_hz: float, turns: float, trials: int
) -> dict[str, Any]:
    """Errors of all trials of one arm on one circle."""
    found: dict[str, Any] = {
        "seed": configuration.simulator.seed,
        "frequency_hz": frequency_hz,
    }
    try:
        learning, _ = repeated(configuration, circle(frequency_hz, turns), trials)
    except LearningError as error:
        return found | {"ended": str(error)}
    return found | {
        "rms_mm": [1e3 * trial.rms_m for trial in learning.trials],
        "before_mm": _error(learning.trials[0]),
        "after_mm": _error(learning.best),
        "advance_s": learning.law.advance_s if learning.law else math.nan,
    }


def _error(trial: Trial) -> dict[str, float]:
    return {"rms": 1e3 * trial.rms_m, "max": 1e3 * trial.max_m}


def main() -> None:
    """Measure and print a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--valves", default="servo", choices=tuple(NOMINAL))
    parser.add_argument("--seeds", type=int, nargs="+", default=[0], help="arms of the family")
    parser.add_argument("--calibrated", action="store_true", help="calibrate the arm first")
    parser.add_argument("--frequencies", type=float, nargs="+", help="Hz (by the valves)")
    parser.add_argument("--time-constant-ms", type=float, help="of the correction (by the valves)")
    parser.add_argument("--turns", type=float, default=2.0, help="how often round")
    parser.add_argument("--trials", type=int, default=10)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows = []
    if not arguments.json:
        print("seed  Hz    before RMS, max mm   after RMS, max mm   RMS of each trial")
    for seed in arguments.seeds:
        arm = arm_with(arguments.valves, seed, arguments.time_constant_ms)
        arm = calibrate_simulated(arm) if arguments.calibrated else arm
        for frequency_hz in arguments.frequencies or FREQUENCIES_HZ[arguments.valves]:
            rows.append(measure(arm, frequency_hz, arguments.turns, arguments.trials))
            if not arguments.json:
                print(_line(rows[-1]), flush=True)
    if arguments.json:
        print(json.dumps({"valves": arguments.valves, "rows": rows}))


def _line(row: dict[str, Any]) -> str:
    start = f"{row['seed']:4}  {row['frequency_hz']:4}"
    if "ended" in row:
        return f"{start}  {row['ended']}"
    before, after = row["before_mm"], row["after_mm"]
    every = " ".join(f"{value:.1f}" for value in row["rms_mm"])
    return (
        f"{start} {before['rms']:9.2f} {before['max']:8.2f} {after['rms']:10.2f}"
        f" {after['max']:8.2f}     {every}"
    )


if __name__ == "__main__":
    main()

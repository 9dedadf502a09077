"""How near the tip comes to its target without feedback, before and after a calibration.

    .venv/bin/python -m tools.bench.calibrated --json

The real loop and the simulated arm, in simulated time. A calibration goes through the plan of
`pneuarm calibrate`, with the true tip plus noise of 0.1 mm as what motion capture would measure.
Then random position targets within reach, 3 s each, behind slow valves until 1.5 s after the
commanded arm is there, and the mean of the true tip over the last 0.4 s against the target, in
percent of the arm's length.
"""

import argparse
import json
import math
from typing import Any

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.targets.targets import PositionTarget
from pneuarm.hardware.simulator.device import DEVICE as SIMULATOR
from pneuarm.hardware.simulator.parameters import NOMINAL, Valves
from pneuarm.service.calibration.simulated import calibrate_simulated
from pneuarm.service.configuration.configuration import Configuration
from tools.rig.arms import random_lengths
from tools.rig.simulated import Bench, add_world, configuration_of

RATE_HZ = 250.0
#: Targets: how much of the way to each limit, how many, how long, averaged over what.
SHARE, TARGETS, SECONDS, AVERAGED_S = 0.5, 15, 3.0, 0.4
#: How long a target is waited for at most, and what follows where that was longer (s).
LONGEST_S, AFTERWARDS_S = 40.0, 1.5


def tip_errors_percent(configuration: Configuration, targets: Array) -> Array:
    """Distances of the true tip at rest from targets (n, 3), percent of the arm's length.

    NaN where the arm says that a target is out of reach: what hangs longer than the nominal arm,
    and has no vacuum, cannot come up to it.
    """
    bench = Bench(configuration=configuration).activate()
    length_m = configuration.build_simulated_arm().total_rest_length_m
    errors = []
    for position_m in targets:
        target = PositionTarget(position_m)
        newest, waited_s = bench.run(SECONDS, target), SECONDS
        while newest["reach"] == Reach.MOVING and waited_s < LONGEST_S:
            bench.run(0.5, target)
            newest, waited_s = bench.newest, waited_s + 0.5
        if waited_s > SECONDS:
            newest = bench.run(AFTERWARDS_S, target)
        ticks = bench.ticks()[-round(AVERAGED_S * RATE_HZ) :]
        bench.records.clear()
        if newest["reach"] == Reach.OUT_OF_REACH:
            errors.append(math.nan)
            continue
        if newest["reach"] != Reach.REACHED:
            raise RuntimeError(f"target {position_m} m is not reached by the commanded arm")
        tip = ticks["tip_true_position_m"].mean(axis=0)
        errors.append(float(100.0 * np.linalg.norm(tip - position_m) / length_m))
    return np.array(errors)


def targets_of(preset: str, seed: int, number: int = TARGETS) -> Array:
    """Random positions (number, 3) within a moderate workspace of the nominal arm, m."""
    arm = configuration_of(preset).build_arm()
    rng = np.random.default_rng([seed, 11])
    return np.array(
        [tip_transform(arm, random_lengths(arm, rng, SHARE))[:3, 3] for _ in range(number)]
    )


def measure(
    preset: str,
    seed: int,
    number: int = TARGETS,
    valves: Valves = "servo",
    world: str = SIMULATOR.name,
) -> dict[str, Any]:
    """Errors of one arm of the family, before and after."""
    targets = targets_of(preset, seed, number)
    nominal = configuration_of(preset, RATE_HZ, seed, valves, world)
    before = tip_errors_percent(nominal, targets)
    after = tip_errors_percent(calibrate_simulated(nominal), targets)
    both = np.isfinite(before) & np.isfinite(after)
    before, after = before[both], after[both]
    return {
        "seed": seed,
        "targets": int(both.sum()),
        "before_percent": {"mean": before.mean(), "max": before.max()},
        "after_percent": {"mean": after.mean(), "max": after.max()},
        "times_smaller": before.mean() / after.mean(),
    }


def main() -> None:
    """Measure the arms of some seeds and print a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--preset", default="paper", choices=("paper", "table1", "trunk"))
    parser.add_argument("--seeds", type=int, default=10, help="arms of the family (default 10)")
    parser.add_argument("--valves", choices=tuple(NOMINAL), default="servo")
    parser.add_argument("--json", action="store_true")
    add_world(parser)
    arguments = parser.parse_args()
    rows = []
    if not arguments.json:
        print("seed  before mean, max %   after mean, max %   times smaller")
    for seed in range(arguments.seeds):
        rows.append(measure(arguments.preset, seed, valves=arguments.valves, world=arguments.world))
        if not arguments.json:
            print(_line(rows[-1]), flush=True)
    worst = max(rows, key=lambda row: row["after_percent"]["mean"])
    if arguments.json:
        told = {"preset": arguments.preset, "valves": arguments.valves, "world": arguments.world}
        print(json.dumps({**told, "rows": rows, "worst": worst}))
    else:
        print(f"worst: seed {worst['seed']}, mean {worst['after_percent']['mean']:.2f} %")


def _line(row: dict[str, Any]) -> str:
    before, after = row["before_percent"], row["after_percent"]
    return (
        f"{row['seed']:4} {before['mean']:9.2f} {before['max']:9.2f} {after['mean']:9.2f}"
        f" {after['max']:9.2f} {row['times_smaller']:12.1f}"
    )


if __name__ == "__main__":
    main()

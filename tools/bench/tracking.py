"""How well the tip follows: the real loop on simulated time, a simulated camera, gravity on.

    .venv/bin/python -m tools.bench.tracking --json

Every figure is of the true tip. The camera takes 100 poses a second, which arrive 10 ms late with
0.1 mm of noise on every axis. Each seed is another arm of the family; the calibrated one has what
`pneuarm calibrate` fits to that very arm, its response too. The seeds from 10 on are none of those
with which the constants of reference and correction were chosen; `--world mujoco` is another
simulator than that.
"""

import argparse
import json
import sys
from typing import Any

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.targets.targets import CircleTarget
from pneuarm.hardware.simulator.parameters import NOMINAL
from pneuarm.service.calibration.simulated import calibrate_simulated
from pneuarm.service.configuration.configuration import Configuration
from tools.bench.calibrated import targets_of
from tools.bench.rig import CameraRig
from tools.rig.simulated import add_world, configuration_of

Row = dict[str, Any]

RATE_HZ = 1000.0

HOME = np.array([0.0, 0.0, 0.2])
CIRCLE = CircleTarget((0.0, 0.0, 0.2), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.04, 0.25)

#: A target is given this time (s), and its error is that of the last part of it.
TARGET_S, STEADY_S = 4.0, 0.5
STEP_S = 3.0
STEPS = 4
CIRCLE_S, WARM_S = 12.0, 4.0
LOST_S = 2.0


def _error(ticks: np.ndarray, position: Array) -> Array:
    error: Array = np.linalg.norm(ticks["tip_true_position_m"] - position, axis=-1)
    return error


def steady_errors_m(rig: CameraRig, targets: Array) -> list[float]:
    """Mean distance of the tip from every target in the last half second."""
    last = round(STEADY_S * 1e9 / rig.period_ns)
    found = []
    for position in targets:
        found.append(float(_error(rig.to(position, TARGET_S), position)[-last:].mean()))
        rig.forget()
    return found


def step(rig: CameraRig, start: Array, end: Array) -> tuple[float, float]:
    """Time until the tip stays within 1 mm, from the target's arrival, and the overshoot."""
    rig.to(start, STEP_S)
    ticks = rig.to(end, STEP_S)
    outside = np.flatnonzero(_error(ticks, end) > 1e-3)
    settled_s = (outside[-1] + 1) * rig.period_ns * 1e-9 if len(outside) else 0.0
    way = (end - start) / np.linalg.norm(end - start)
    beyond = ((ticks["tip_true_position_m"] - end) @ way).max() / np.linalg.norm(end - start)
    rig.forget()
    return settled_s, max(0.0, float(beyond))


def steps(rig: CameraRig, seed: int) -> list[tuple[float, float]]:
    """Steps of 50 mm through the middle of the workspace, in random directions."""
    rng = np.random.default_rng([seed, 3])
    found = []
    for angle in rng.uniform(0.0, 2.0 * np.pi, STEPS):
        half = 0.025 * np.array([np.cos(angle), np.sin(angle), 0.0])
        found.append(step(rig, HOME - half, HOME + half))
    return found


def circle_rms_m(rig: CameraRig) -> float:
    """Root of the mean squared distance from the circle's point of the time, after a turn."""
    rig.circle(CIRCLE, WARM_S)
    ticks = rig.circle(CIRCLE, CIRCLE_S - WARM_S)
    error = _error(ticks, ticks["reference_position_m"])
    return float(np.sqrt((error**2).mean()))


def _jumps(ticks: np.ndarray) -> dict[str, float]:
    """Largest change in a tick, of the commanded tip (mm) and of a pressure (mbar)."""
    tip = np.linalg.norm(np.diff(ticks["tip_commanded_position_m"], axis=0), axis=1)
    pressure = np.abs(np.diff(ticks["pressure_sent_pa"], axis=0))
    return {"tip_mm": 1e3 * float(tip.max()), "pressure_mbar": 0.01 * float(pressure.max())}


def camera_lost(rig: CameraRig) -> dict[str, dict[str, float]]:
    """Largest jumps of the commands on the circle: undisturbed, camera lost, camera back."""
    rig.circle(CIRCLE, WARM_S)
    undisturbed = _jumps(rig.circle(CIRCLE, 4.0))
    rig.camera = False
    lost = _jumps(rig.circle(CIRCLE, LOST_S))
    rig.camera = True
    back = _jumps(rig.circle(CIRCLE, 2.0))
    return {"undisturbed": undisturbed, "lost": lost, "back": back}


def measure(configuration: Configuration, camera: bool, targets: int) -> Row:
    """All figures of one arm."""
    seed = configuration.simulated.seed
    rig = CameraRig(configuration, camera=camera).activate()
    rig.to(HOME, STEP_S)
    row: Row = {
        "seed": seed,
        "steady_mm": [1e3 * e for e in steady_errors_m(rig, targets_of("paper", seed, targets))],
    }
    if camera:
        row["steps"] = steps(rig, seed)
    row["circle_rms_mm"] = 1e3 * circle_rms_m(rig)
    if camera:
        row["camera_lost"] = camera_lost(rig)
    return row


def summary(rows: list[Row]) -> Row:
    """Medians and worst over seeds and targets."""
    steady = np.concatenate([row["steady_mm"] for row in rows])
    circles = [row["circle_rms_mm"] for row in rows]
    found: Row = {
        "steady_mm": {
            "median": float(np.median(steady)),
            "p90": float(np.percentile(steady, 90)),
            "worst": float(steady.max()),
            "number": len(steady),
        },
        "circle_rms_mm": {
            "by_seed": {str(row["seed"]): row["circle_rms_mm"] for row in rows},
            "median": float(np.median(circles)),
            "worst": max(circles),
        },
    }
    if "steps" in rows[0]:
        times, over = np.array([one for row in rows for one in row["steps"]]).T
        found["step"] = {
            "settled_s": {"median": float(np.median(times)), "worst": float(times.max())},
            "overshoot_percent": {
                "median": 100.0 * float(np.median(over)),
                "worst": 100.0 * float(over.max()),
            },
            "number": len(times),
        }
        found["camera_lost"] = {
            phase: {
                name: max(row["camera_lost"][phase][name] for row in rows)
                for name in ("tip_mm", "pressure_mbar")
            }
            for phase in ("undisturbed", "lost", "back")
        }
    return found


def _measured(name: str, arms: list[Configuration], camera: bool, targets: int) -> Row:
    rows = []
    for arm in arms:
        rows.append(measure(arm, camera, targets))
        print(name, json.dumps(summary(rows[-1:])), file=sys.stderr, flush=True)
    return summary(rows)


def _calibrated(arm: Configuration) -> Configuration:
    print("calibrating seed", arm.simulated.seed, file=sys.stderr, flush=True)
    return calibrate_simulated(arm)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="one JSON object instead of lines")
    parser.add_argument("--seeds", type=int, nargs="+", default=[10, 11, 12, 13])
    parser.add_argument("--targets", type=int, default=50, help="for each seed (default 50)")
    parser.add_argument("--valves", choices=tuple(NOMINAL), default="servo")
    parser.add_argument("--alone", action="store_true", help="only calibrated and with the camera")
    add_world(parser)
    arguments = parser.parse_args()
    arms = [
        configuration_of("paper", RATE_HZ, seed, arguments.valves, arguments.world)
        for seed in arguments.seeds
    ]
    known = [_calibrated(arm) for arm in arms]
    few = max(1, arguments.targets // 5)
    found: Row = {
        "seeds": arguments.seeds,
        "rate_hz": RATE_HZ,
        "valves": arguments.valves,
        "world": arguments.world,
    }
    found["calibrated"] = _measured("calibrated", known, True, arguments.targets)
    if not arguments.alone:
        found["uncalibrated"] = _measured("uncalibrated", arms, True, few)
        found["calibrated_no_feedback"] = _measured("without feedback", known, False, few)
        found["uncalibrated_no_feedback"] = _measured("neither", arms, False, few)
    if arguments.json:
        print(json.dumps(found, indent=2))
        return
    for name, values in found.items():
        print(name, json.dumps(values))


if __name__ == "__main__":
    main()

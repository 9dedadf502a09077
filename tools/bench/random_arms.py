"""Arms at random behind valves and cameras at random: does the feedback of any of them swing?

    .venv/bin/python -m tools.bench.random_arms --arms 100

The real loop on simulated time, with the monitors that latch faults. Each arm is another seed of
the family and knows its geometry alone, or, every other one, its hysteresis too. Its valves fill
with a lag of 50 ms to 2 s, exhaust one to five times as slowly, and wait up to 300 ms before. The
camera takes 5 to 200 poses a second, which arrive 10 to 60 ms late. Response and camera are told as
a laboratory would that has measured them; with ``--untold`` the response is not, and the monitor of
pressures is told to let slow valves be. The tip goes to two places, and is to stand there.
"""

import argparse
import json
import sys
from dataclasses import asdict, dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.modes.mode import Mode
from tools.bench.responses import LopsidedArm
from tools.bench.rig import CameraRig
from tools.rig.simulated import configuration_of

RATE_HZ = 200.0
PLACES_M = np.array([[0.04, 0.0, 0.2], [-0.02, 0.03, 0.21]])
#: A place is given this time (s). After the first the tip swings that turns so often by so much.
TO_S, STAND_S = 10.0, 5.0
TURNS, LEAST_M = 3, 2e-3
HYSTERESIS_BAR = 0.04


@dataclass(frozen=True)
class Drawn:
    """What an arm's valves and camera are, and what is known of it."""

    seed: int
    filling_s: float
    exhausting_s: float
    delay_s: float
    camera_hz: float
    camera_late_s: float
    hysteresis_known: bool

    def device(self, configuration: Configuration) -> LopsidedArm:
        """Make the arm that a configuration simulates, behind these valves."""
        arm = configuration.build_simulated_arm()
        return LopsidedArm(arm, self.seed, self.filling_s, self.exhausting_s, self.delay_s)


@dataclass(frozen=True)
class Found:
    """What became of it; ``swings_m`` is the largest way from turn to turn at each place, or 0."""

    swings_m: list[float]
    error_m: float
    past_limit: bool
    fault: str
    turned_down: bool


def draw(number: int) -> Drawn:
    """Return the arm of a number: the same on every machine."""
    rng = np.random.default_rng([number, 17])
    filling_s = float(np.exp(rng.uniform(np.log(0.05), np.log(2.0))))
    return Drawn(
        seed=number,
        filling_s=filling_s,
        exhausting_s=filling_s * float(np.exp(rng.uniform(0.0, np.log(5.0)))),
        delay_s=float(rng.uniform(0.0, 0.3)),
        camera_hz=float(np.exp(rng.uniform(np.log(5.0), np.log(200.0)))),
        camera_late_s=float(rng.uniform(0.01, 0.06)),
        hysteresis_known=bool(number % 2),
    )


def configured(drawn: Drawn, told: bool = True) -> Configuration:
    """Return what such an arm is told to be."""
    whole = configuration_of("paper", RATE_HZ, drawn.seed)
    tables = whole.model_dump(exclude_none=True)
    tables["simulator"]["arm"] = whole.arm.model_dump(exclude_none=True)
    if drawn.hysteresis_known:
        tables["arm"]["sections"][0]["hysteresis_bar"] = HYSTERESIS_BAR
    if told:
        tables["arm"]["response"] |= {
            "filling_lag_ms": 1e3 * drawn.filling_s,
            "exhausting_lag_ms": 1e3 * drawn.exhausting_s,
            "delay_ms": 1e3 * drawn.delay_s,
        }
    else:
        tables["monitors"]["pressure_deviates"]["deviation_bar"] = 5.0
    tables["feedback"] |= {
        "camera_delay_ms": 1e3 * drawn.camera_late_s,
        "camera_timeout_ms": max(100.0, 3e3 / drawn.camera_hz),
    }
    return Configuration.model_validate(tables)


def swing_of(tips_m: Array) -> float:
    """Largest way (m) between turns of tips (ticks, 3), where an axis turns often enough."""
    return max(_swing_along(axis.tolist()) for axis in tips_m.T)


def _swing_along(values_m: list[float]) -> float:
    turn_m = far_m = values_m[0]
    way, sizes_m = 0.0, list[float]()
    for value_m in values_m:
        if way == 0.0 and abs(value_m - turn_m) > LEAST_M:
            way = 1.0 if value_m > turn_m else -1.0
        if way * (value_m - far_m) >= 0.0:
            far_m = value_m
        elif abs(value_m - far_m) > LEAST_M:
            sizes_m.append(abs(far_m - turn_m))
            turn_m, far_m, way = far_m, value_m, -way
    return max(sizes_m[1:]) if len(sizes_m) >= TURNS else 0.0


def run(drawn: Drawn, told: bool = True) -> Found:
    """Let it go to both places."""
    whole = configured(drawn, told)
    rig = CameraRig(
        whole,
        camera_hz=drawn.camera_hz,
        delay_s=drawn.camera_late_s,
        device=drawn.device(whole),
    ).activate()
    low_m, high_m = rig.arm.length_interval_m
    swings_m, error_m, past_limit = list[float](), 0.0, False
    for place_m in PLACES_M:
        rig.to(place_m, TO_S)
        ticks = rig.to(place_m, STAND_S)
        swings_m.append(swing_of(ticks["tip_true_position_m"]))
        error_m = float(np.linalg.norm(ticks["tip_true_position_m"][-1] - place_m))
        lengths_m = rig.ticks()["length_commanded_m"]
        past_limit |= bool(((lengths_m < low_m) | (lengths_m > high_m)).any())
        rig.forget()
    faults = [e.text for e in rig.events if e.mode == pb.FAULT or e.level == pb.ERROR]
    if rig.loop.mode != Mode.ACTIVE and not faults:
        faults = [rig.loop.mode.name.lower()]
    turned_down = any(event.code == "correction_swings" for event in rig.events)
    return Found(swings_m, error_m, past_limit, faults[0] if faults else "", turned_down)


def main() -> None:
    """Print a line an arm, and what was found of all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--arms", type=int, default=100)
    parser.add_argument("--first", type=int, default=100, help="number of the first (default 100)")
    parser.add_argument("--untold", action="store_true", help="nobody has measured the response")
    parser.add_argument("--json", action="store_true", help="the sum as one JSON object")
    arguments = parser.parse_args()
    rows = []
    for number in range(arguments.first, arguments.first + arguments.arms):
        drawn = draw(number)
        found = run(drawn, not arguments.untold)
        rows.append(found)
        row = {**asdict(drawn), **asdict(found)}
        print(json.dumps(row), file=sys.stderr, flush=True)
    errors_mm = [1e3 * row.error_m for row in rows]
    total = {
        "arms": len(rows),
        "swinging": sum(max(row.swings_m) > 0.0 for row in rows),
        "swinging_at_the_last": sum(row.swings_m[-1] > 0.0 for row in rows),
        "past_a_limit": sum(row.past_limit for row in rows),
        "faults": sum(bool(row.fault) for row in rows),
        "turned_down": sum(row.turned_down for row in rows),
        "error_mm": {"median": float(np.median(errors_mm)), "worst": max(errors_mm)},
    }
    print(json.dumps(total, indent=2) if arguments.json else total)


if __name__ == "__main__":
    main()

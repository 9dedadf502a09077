"""How long one whole step of the inverse kinematics takes, beside its peers, on one core.

    make bench-setup
    .venv/bin/python -m tools.bench.ik --json
    .venv/bin/python -m tools.bench.ik --reach --json     # the campaign of tools/bench/reach.py too

A step is what the loop calls: error, Jacobian, QP, solution, exact checks, verdict, by
``Controller.step``. Two motions: ``ik_us`` between random reachable positions, where most QPs are
free of any row and need no solver; ``ik_at_limits_us`` toward targets out of reach, where OSQP is
asked in almost every tick. Ours and the peers' take turns in the same run.
"""

import argparse
import json
import os
import platform
import statistics
import sys
import time

import numpy as np

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.controller import Controller
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from pneuarm.controllers.laws.settings import ControlSettings
from pneuarm.controllers.targets.targets import PositionTarget
from tools.bench.ik_peers import peers_us
from tools.rig.arms import paper_arm, random_lengths

DT_S = 1e-3
STEPS_A_TARGET = 400
Figures = dict[str, float]


def arm_of(sections: int) -> Arm:
    """Several times the section of the paper's arm."""
    return Arm(f"{sections}", paper_arm().sections * sections)


class Candidate:
    """A controller on the way from target to target."""

    def __init__(self, sections: int, out_of_reach: bool) -> None:
        self._arm, self._far = arm_of(sections), out_of_reach
        self._rng = np.random.default_rng(0)
        self._controller = Controller(self._arm, ControlSettings())
        self._controller.warm_up()
        self.seconds: list[float] = []
        self._asked = 0

    def _target(self) -> PositionTarget:
        if self._far:
            direction = self._rng.standard_normal(3)
            length = 1.5 * self._arm.max_length_m / np.linalg.norm(direction)
            return PositionTarget(length * direction)
        lengths = random_lengths(self._arm, self._rng, 0.9)
        return PositionTarget(tip_transform(self._arm, lengths)[:3, 3])

    def run(self, targets: int) -> None:
        """Time every step of some motions."""
        step, clock = self._controller.step, time.perf_counter
        solver = self._controller._chambers.qp_ik._solver
        for _ in range(targets):
            self._controller.set_target(self._target())
            if self._far:  # on the way there, untimed
                for _ in range(300):
                    step(10.0 * DT_S)
            before = solver.asked
            for _ in range(STEPS_A_TARGET):
                start = clock()
                step(DT_S)
                self.seconds.append(clock() - start)
            self._asked += solver.asked - before

    def us(self) -> Figures:
        """Percentiles, and the share of steps in which OSQP was asked."""
        p50, p99, p999 = (1e6 * np.percentile(self.seconds, [50, 99, 99.9])).tolist()
        share = self._asked / len(self.seconds)
        return {"p50": p50, "p99": p99, "p999": p999, "osqp_share": share}


def peers() -> dict[str, float] | None:
    """Medians of the peers, once; None where their packages are missing."""
    try:
        return peers_us()
    except ModuleNotFoundError:
        return None


def figures(rounds: int) -> dict[str, object]:
    """All figures as one object."""
    sections = {"": 1, "_3_sections": 3, "_6_sections": 6}
    candidates = {
        f"ik{at}{name}_us": Candidate(number, bool(at))
        for name, number in sections.items()
        for at in ("", "_at_limits")
    }
    seen: dict[str, list[float]] = {}
    startup = time.perf_counter()
    Controller(paper_arm(), ControlSettings()).warm_up()
    startup = time.perf_counter() - startup
    for _ in range(rounds):
        for candidate in candidates.values():
            candidate.run(5)
        for name, value in (peers() or {}).items():
            seen.setdefault(name, []).append(value)
    result: dict[str, object] = {name: each.us() for name, each in candidates.items()}
    result["peers_us"] = {name: statistics.median(values) for name, values in seen.items()}
    fastest = min((statistics.median(values) for values in seen.values()), default=None)
    mine = candidates["ik_us"].us()["p50"]
    at_limits = candidates["ik_at_limits_us"].us()["p50"]
    result["times_faster_than_fastest_peer"] = fastest / mine if fastest else None
    result["times_faster_at_limits"] = fastest / at_limits if fastest else None
    if not seen:
        print("the peers' packages are missing: make bench-setup", file=sys.stderr)
    return result | {
        "startup_s": startup,
        "rounds": rounds,
        "machine": platform.machine(),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="one JSON object")
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--reach", action="store_true", help="the campaign of reach as well")
    parser.add_argument("--share", type=float, default=1.0, help="of the campaign")
    arguments = parser.parse_args()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    result = figures(arguments.rounds)
    if arguments.reach:
        from tools.bench.reach import campaign

        result["reach"] = campaign(arguments.share)
    if arguments.json:
        print(json.dumps(result, indent=2, default=lambda value: value.item()))
    else:
        for name, value in result.items():
            print(f"{name:32} {value}")


if __name__ == "__main__":
    main()

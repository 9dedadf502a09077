"""How long one step of inverse kinematics takes with pin-pink and with mink, per QP solver.

    make bench-setup
    .venv/bin/python -m tools.bench.ik_peers --json

The arm is one section of the paper's as a chain of four joints that rigid-body libraries know:
turn by phi, tilt by theta/2, slide along the chord, tilt by theta/2 again. The tip's target runs
along a circle and back, so that every step is a real one. A step is what a program calls at every
tick: error, Jacobian and QP under the libraries' own limits of configuration and velocity, its
solution, and the integration. Setting the target is not timed. Both libraries are called as their
documentation shows, with every solver that qpsolvers finds.
"""

import argparse
import itertools
import json
import math
import statistics
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

MISSING = "the peers are not installed ({}); run: make bench-setup"

STEPS, ROUNDS = 2000, 7
_WARM_UP = 200

PERIOD_S = 1e-3
RADIUS_M, HEIGHT_M = 0.04, 0.21
#: The target turns back before it meets the limit of the first joint, where the chain is cut open.
_SWING_RAD, _SWING_PERIOD_S = 3.0, 6.0

#: Joints phi, theta/2, chord, theta/2: bounds from Eq. (4), 150 degrees of bend and 38 mm offset;
#: speeds from chambers at 200 mm/s.
JOINTS = ("phi", "tilt", "chord", "tilt_again")
LOW = np.array([-math.pi, 0.0, 0.1, 0.0])
HIGH = np.array([math.pi, 1.31, 0.3, 1.31])
SPEED = np.array([5.0, 2.6, 0.2, 2.6])

#: The tip's position does not depend on the last joint: the damping alone settles that one.
_DAMPING = 1e-6

#: As it comes, OSQP stops 0.7 mm beside the target; this costs it no time that can be measured.
_SOLVER_OPTIONS: dict[str, dict[str, float | bool]] = {
    "osqp": {"eps_abs": 1e-8, "eps_rel": 1e-8, "raise_error": False}
}

_MJCF_LINK = """<body name="{name}_link"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<joint name="{name}" type="{kind}" axis="{axis}" limited="true" range="{low} {high}"/>"""


@dataclass(frozen=True)
class Peer:
    """A library with the arm and one solver: set the target (3,) m, make one step, ask the tip."""

    aim: Callable[[np.ndarray], None]
    step: Callable[[], None]
    tip_m: Callable[[], np.ndarray]


def target_m(time_s: float) -> np.ndarray:
    """Position (3,) of the target: to and fro along the circle."""
    turn = _SWING_RAD * math.sin(2.0 * math.pi * time_s / _SWING_PERIOD_S)
    return np.array([RADIUS_M * math.cos(turn), RADIUS_M * math.sin(turn), HEIGHT_M])


def _start() -> np.ndarray:
    """Joints (4,) that have the tip at the target of time 0."""
    tilt = math.atan2(RADIUS_M, HEIGHT_M)
    return np.array([0.0, tilt, math.hypot(RADIUS_M, HEIGHT_M), tilt])


def solvers() -> list[str]:
    """Names of the QP solvers that qpsolvers finds."""
    import qpsolvers

    return sorted(qpsolvers.available_solvers)


def pink_peer(solver: str) -> Peer:
    """The arm in pin-pink: configuration and velocity limits come from the model."""
    import pinocchio as pin
    from pink import Configuration, solve_ik
    from pink.tasks import FrameTask

    model, parent = pin.Model(), 0
    kinds = (pin.JointModelRZ(), pin.JointModelRY(), pin.JointModelPZ(), pin.JointModelRY())
    for index, (name, kind) in enumerate(zip(JOINTS, kinds, strict=True)):
        bounds = (SPEED[[index]], LOW[[index]], HIGH[[index]])
        parent = model.addJoint(parent, kind, pin.SE3.Identity(), name, np.ones(1), *bounds)
    model.addFrame(pin.Frame("tip", parent, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    configuration = Configuration(model, model.createData(), _start())
    task = FrameTask("tip", position_cost=1.0, orientation_cost=0.0)
    options = _SOLVER_OPTIONS.get(solver, {})

    def step() -> None:
        velocity = solve_ik(
            configuration, [task], PERIOD_S, solver=solver, damping=_DAMPING, **options
        )
        configuration.integrate_inplace(velocity, PERIOD_S)

    return Peer(
        lambda position_m: task.set_target(pin.SE3(np.eye(3), position_m)),
        step,
        lambda: configuration.get_transform_frame_to_world("tip").translation,
    )


def mink_peer(solver: str) -> Peer:
    """The arm in mink: the configuration limit from the model, the velocity limit beside it."""
    import mink
    import mujoco

    model = mujoco.MjModel.from_xml_string(_mjcf())
    configuration = mink.Configuration(model, _start())
    task = mink.FrameTask("tip", "site", position_cost=1.0, orientation_cost=0.0)
    speeds = dict(zip(JOINTS, SPEED, strict=True))
    limits = [mink.ConfigurationLimit(model), mink.VelocityLimit(model, speeds)]
    options = _SOLVER_OPTIONS.get(solver, {})

    def step() -> None:
        velocity = mink.solve_ik(
            configuration, [task], PERIOD_S, solver, damping=_DAMPING, limits=limits, **options
        )
        configuration.integrate_inplace(velocity, PERIOD_S)

    return Peer(
        lambda position_m: task.set_target(mink.SE3.from_translation(position_m)),
        step,
        lambda: configuration.get_transform_frame_to_world("tip", "site").translation(),
    )


def _mjcf() -> str:
    kinds = (("hinge", "0 0 1"), ("hinge", "0 1 0"), ("slide", "0 0 1"), ("hinge", "0 1 0"))
    links = "".join(
        _MJCF_LINK.format(name=name, kind=kind, axis=axis, low=low, high=high)
        for name, (kind, axis), low, high in zip(JOINTS, kinds, LOW, HIGH, strict=True)
    )
    ends = "</body>" * len(JOINTS)
    return (
        '<mujoco><compiler angle="radian"/><worldbody>'
        f'{links}<site name="tip"/>{ends}</worldbody></mujoco>'
    )


def peers() -> dict[str, Peer]:
    """Every library with every solver; raises ModuleNotFoundError with what to do."""
    # Both libraries hand dense matrices to qpsolvers, which says so for OSQP.
    warnings.filterwarnings("ignore", "Converted matrix")
    made = {"pin-pink": pink_peer, "mink": mink_peer}
    try:
        return {f"{name} {solver}": made[name](solver) for name in made for solver in solvers()}
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(MISSING.format(error), name=error.name) from error


def targets() -> Iterator[np.ndarray]:
    """Targets (3,) of one tick after the other, without end."""
    return (target_m(number * PERIOD_S) for number in itertools.count(1))


def follow(peer: Peer, path: Iterator[np.ndarray], steps: int) -> float:
    """Follow the target for some steps; return the median time of one in microseconds."""
    taken_ns = []
    for position_m in itertools.islice(path, steps):
        peer.aim(position_m)
        begin = time.perf_counter_ns()
        peer.step()
        taken_ns.append(time.perf_counter_ns() - begin)
    return statistics.median(taken_ns) * 1e-3


def peers_us(steps: int = STEPS, rounds: int = ROUNDS) -> dict[str, float]:
    """Median microseconds of one step by library and solver: the median of rounds in turns.

    Raises ModuleNotFoundError, with what to do, where a library is not installed.
    """
    candidates = peers()
    paths = {name: targets() for name in candidates}
    medians: dict[str, list[float]] = {name: [] for name in candidates}
    for name, peer in candidates.items():
        follow(peer, paths[name], _WARM_UP)
    for _ in range(rounds):
        for name, peer in candidates.items():
            medians[name].append(follow(peer, paths[name], steps))
    return {name: statistics.median(values) for name, values in medians.items()}


def main() -> int:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="one JSON object")
    parser.add_argument("--steps", type=int, default=STEPS, help=f"in a round ({STEPS})")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help=f"for each ({ROUNDS})")
    arguments = parser.parse_args()
    try:
        found = peers_us(arguments.steps, arguments.rounds)
    except ModuleNotFoundError as error:
        print(error, file=sys.stderr)
        return 1
    if arguments.json:
        print(json.dumps(found, indent=2))
    else:
        for name, value in found.items():
            print(f"{name:20} {value:6.1f} us")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

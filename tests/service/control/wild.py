"""A user who does everything at random, and what must hold all the same."""

import itertools

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.targets.targets import (
    LawName,
    LengthsTarget,
    PoseTarget,
    PositionTarget,
    PressuresTarget,
    Target,
    TwistTarget,
)
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.processes.pipe import RequestMode
from tools.rig.simulated import Bench


def random_target(bench: Bench, rng: np.random.Generator) -> Target:
    """Any target that may come through the checks, reachable or not."""
    arm, law = bench.arm, LawName(int(rng.integers(0, 3)))
    shape = (arm.n_sections, 3)
    kind = rng.integers(0, 5)
    position = rng.normal(size=3) * arm.max_length_m
    if kind == 0:
        return PositionTarget(position, law)
    if kind == 1:
        quaternion = rng.normal(size=4)
        return PoseTarget(position, quaternion / np.linalg.norm(quaternion), law)
    if kind == 2:
        angular = rng.normal(size=3) * 5 if rng.random() < 0.5 else None
        return TwistTarget(rng.normal(size=3) * 2, angular, bool(rng.random() < 0.5), False, law)
    if kind == 3:
        low, high = arm.per_chamber("length_min_m"), arm.per_chamber("length_max_m")
        return LengthsTarget(rng.uniform(low, high, shape), law)
    low, high = arm.per_chamber("pressure_min_pa"), arm.per_chamber("pressure_max_pa")
    return PressuresTarget(rng.uniform(low, high, shape), law)


def wild_run(bench: Bench, seconds: float, seed: int) -> None:
    """Random targets and now and then any request, for some time."""
    rng = np.random.default_rng(seed)
    bench.get_ready()
    for _ in range(round(seconds * 1e9 / bench.period_ns)):
        commands = []
        if rng.random() < 0.05:
            commands.append(bench.target(random_target(bench, rng)))
        if rng.random() < 0.01:
            event = ModeEvent(int(rng.integers(2, 8)))
            commands.append(RequestMode(event, 2, "somebody"))
        if bench.mode in (Mode.READY, Mode.HOLD) and rng.random() < 0.1:
            commands.append(RequestMode(ModeEvent.ENABLE, 2, "somebody"))
        if bench.mode in (Mode.FAULT, Mode.ESTOP):
            commands.append(RequestMode(ModeEvent.RESET, 2, "somebody"))
        bench.tick(*commands)


def assert_writes_within_limits_and_slew(bench: Bench) -> None:
    """Over every write the device saw; venting between two of them starts again from zero."""
    arm = bench.arm
    low, high = arm.per_chamber("pressure_min_pa"), arm.per_chamber("pressure_max_pa")
    slew = arm.per_chamber("pressure_slew_max_pa_s")
    calls: list[tuple[float, Array]] = [
        (time_s, np.zeros_like(low)) for time_s in bench.hardware.vents
    ] + bench.hardware.writes
    calls.sort(key=lambda call: call[0])
    assert len(bench.hardware.writes) > 100
    writes = {id(pressures) for _, pressures in bench.hardware.writes}
    for (before_s, before), (now_s, now) in itertools.pairwise(calls):
        assert np.isfinite(now).all()
        assert (now >= low).all()
        assert (now <= high).all()
        if id(now) in writes:
            largest = slew * (now_s - before_s) + 1e-6
            assert (np.abs(now - before) <= largest).all()

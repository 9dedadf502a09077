"""Invariant 17: an arm that swings because its model is wrong stands after a while; it is told."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from pneuarm.controllers.targets.targets import CircleTarget, PositionTarget
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.processes.pipe import RequestMode
from tests.service.control.test_loop_calibrated import calibrated_configuration
from tools.bench import random_arms
from tools.bench.responses import LopsidedArm
from tools.bench.rig import CameraRig

RATE_HZ = 200.0
HOME = np.array([0.0, 0.0, 0.2])
GOAL = np.array([0.04, 0.0, 0.2])
#: Lags of filling and exhausting, and dead time (s), of valves that are told to have 60, 60, 5 ms.
SLOW, SLOWER, LATE = (0.2, 0.6, 0.03), (0.45, 1.6, 0.06), (0.15, 0.25, 0.3)


def configuration() -> Configuration:
    """A calibrated arm that believes in quick valves; its pressure monitor lets slow ones be."""
    whole = calibrated_configuration()
    control = whole.control.model_copy(update={"rate_hz": RATE_HZ})
    deviates = whole.monitors.pressure_deviates.model_copy(update={"deviation_bar": 5.0})
    monitors = whole.monitors.model_copy(update={"pressure_deviates": deviates})
    return whole.model_copy(update={"control": control, "monitors": monitors})


def rig_behind(valves: tuple[float, float, float] | None) -> CameraRig:
    """An armed rig behind such valves; None has those that it is told to have."""
    whole = configuration()
    device = None
    if valves is not None:
        device = LopsidedArm(whole.build_simulated_arm(), whole.simulated.seed, *valves)
    return CameraRig(whole, device=device).activate()


def swing_m(ticks: np.ndarray, seconds: float) -> float:
    """Largest way of the true tip along an axis in the last seconds."""
    tips = ticks["tip_true_position_m"][-round(RATE_HZ * seconds) :]
    return float(np.ptp(tips, axis=0).max())


def time_constant_s(rig: CameraRig) -> float:
    return rig.loop._steering._observer.time_constant_s


def told(rig: CameraRig) -> list[pb.Event]:
    return [event for event in rig.events if event.code == "correction_swings"]


@pytest.mark.parametrize(
    ("valves", "swings_s"),
    [(SLOWER, 10.0), (LATE, 8.0)],
    ids=["slower", "late"],
)
def test_a_correction_that_swings_is_turned_down_and_told_once(
    valves: tuple[float, float, float], swings_s: float
) -> None:
    rig = rig_behind(valves)
    assert swing_m(rig.to(GOAL, swings_s), 3.0) > 5e-3
    ticks = rig.to(GOAL, 20.0)
    assert swing_m(ticks, 4.0) < 1e-3
    assert np.linalg.norm(ticks["tip_true_position_m"][-1] - GOAL) < 2e-3
    assert rig.loop.mode == Mode.ACTIVE
    (event,) = told(rig)
    assert event.level == pb.WARNING
    assert "[arm.response]" in event.cause
    assert "`pneuarm calibrate`" in event.remedy


def test_a_swing_on_the_way_round_a_slow_circle_is_turned_down_too() -> None:
    rig = rig_behind(LATE)
    circle_m = CircleTarget((0.0, 0.0, 0.2), (1, 0, 0), (0, 1, 0), 0.03, 0.1)
    before = rig.circle(circle_m, 8.0)
    after = rig.circle(circle_m, 24.0)
    assert len(told(rig)) == 1
    last = round(5.0 * RATE_HZ)
    heights_m = [np.ptp(ticks["tip_true_position_m"][-last:, 2]) for ticks in (before, after)]
    assert heights_m[0] > 0.03
    assert heights_m[1] < 0.01


def test_it_stays_turned_down_through_a_hold_and_is_tried_anew_from_idle() -> None:
    rig = rig_behind(LATE)
    rig.to(GOAL, 12.0)
    assert len(told(rig)) == 1
    rig.rest(RequestMode(ModeEvent.HOLD, 4, "bench"), 0.5)
    rig.rest(RequestMode(ModeEvent.ENABLE, 6, "bench"), 0.1)
    assert swing_m(rig.to(HOME, 12.0), 4.0) < 2e-3
    assert len(told(rig)) == 1
    slow_s = time_constant_s(rig)
    rig.rest(RequestMode(ModeEvent.VENT, 8, "bench"), 5.0)
    assert time_constant_s(rig) == slow_s
    rig.rest(RequestMode(ModeEvent.ENABLE, 10, "bench"), 0.1)
    assert rig.loop.mode == Mode.ACTIVE
    assert time_constant_s(rig) < 0.2 * slow_s


def test_much_dead_time_and_a_slow_camera_that_are_told_swing_nothing() -> None:
    found = random_arms.run(random_arms.draw(127))
    assert max(found.swings_m) == 0.0
    assert not found.turned_down
    assert not found.fault


def steps(rig: CameraRig) -> None:
    """To and fro, further apart and nearer, standing in between."""
    for number, way_m in enumerate((0.04, 0.02, 0.01, 0.005, 0.002) * 2):
        rig.to(HOME + np.array([way_m * (-1.0) ** number, 0.5 * way_m, 0.0]), 1.5)


def eight(rig: CameraRig, period_s: float) -> None:
    """As the demo streams it, then home."""
    for number in range(round(3.0 * period_s / 0.02)):
        angle = 2.0 * np.pi * 0.02 * number / period_s
        way = np.array([0.04 * np.sin(angle), 0.02 * np.sin(2.0 * angle), 0.0])
        rig.run(0.02, PositionTarget(HOME + way))
    rig.to(HOME, 4.0)


def circle(rig: CameraRig, frequency_hz: float) -> None:
    rig.circle(CircleTarget((0.0, 0.0, 0.2), (1, 0, 0), (0, 1, 0), 0.04, frequency_hz, 3.0), 12.0)


def frozen(rig: CameraRig) -> None:
    """A camera that stands still, with noise, while the arm is sent about."""
    pose = rig.hardware.tip
    rng = np.random.default_rng(3)
    rig.lie = lambda _p, q, _at_s: (pose[0] + rng.normal(0.0, 3e-4, 3), q)  # type: ignore[index]
    rig.to(HOME, 4.0)
    steps(rig)


@pytest.mark.parametrize("valves", [None, SLOW], ids=["told", "slow"])
@pytest.mark.parametrize(
    "motion",
    [steps, partial(eight, period_s=2.0), partial(circle, frequency_hz=0.25)],
    ids=["steps", "eight", "circle"],
)
def test_what_is_wanted_is_no_swing(
    motion: Callable[[CameraRig], None], valves: tuple[float, float, float] | None
) -> None:
    rig = rig_behind(valves)
    motion(rig)
    assert not told(rig)


def test_a_frozen_camera_is_no_swing() -> None:
    rig = rig_behind(None)
    rig.to(HOME, 2.0)
    frozen(rig)
    assert not told(rig)

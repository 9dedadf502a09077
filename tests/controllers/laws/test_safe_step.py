"""No limit is ever left, whatever is asked for; and what slows the arm down does not turn it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Arm, HalfSpace, Sphere
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.controller import Controller
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from pneuarm.controllers.limits.keep_out import KeepOutLimit
from pneuarm.controllers.limits.limits import refuse_contradictions
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.targets.targets import (
    DirectionTarget,
    LawName,
    LengthsTarget,
    PointTarget,
    PositionTarget,
    PressuresTarget,
    Target,
    TwistTarget,
)
from tests.controllers.laws.driving import DT_S, SETTINGS, assert_within_limits, run, starting_at
from tools.rig.arms import ARMS, PAPER_SECTION, paper_arm, random_lengths, trunk_arm

WALL = HalfSpace((1.0, 0.0, 0.0), 0.06)
BALL = Sphere((0.09, 0.0, 0.2), 0.03)
KEPT_OUT = {
    "wall": replace(paper_arm(), keep_outs=(WALL,), body_radius_m=0.01),
    "ball": replace(paper_arm(), keep_outs=(BALL,), body_radius_m=0.01),
    "trunk": replace(
        trunk_arm(), keep_outs=(WALL, Sphere((0.0, 0.12, 0.3), 0.05)), body_radius_m=0.01
    ),
}
controller_of = cache(lambda arm: Controller(arm, SETTINGS))


def garbage(arm: Arm, rng: np.random.Generator) -> Target:
    """Any finite target, far beyond what the gateway would let through."""
    size, law = 10.0 ** rng.uniform(-3, 6), LawName(int(rng.integers(3)))
    vector = size * rng.standard_normal(3)
    chambers = rng.uniform(-1.0, 2.0, (arm.n_sections, 3))
    match rng.integers(6):
        case 0:
            return TwistTarget(
                vector, size * rng.standard_normal(3), rng.random() < 0.5, False, law
            )
        case 1:
            return LengthsTarget(chambers, law)
        case 2:
            return PressuresTarget(1e6 * chambers, law)
        case 3:
            return DirectionTarget(vector / np.linalg.norm(vector), law)
        case 4:
            return PointTarget(vector, float(rng.uniform(0.1, 1.0)), law)
    return PositionTarget(vector, law)


@pytest.mark.parametrize("arm", [*ARMS.values(), *KEPT_OUT.values()], ids=[*ARMS, *KEPT_OUT])
@settings(max_examples=6)
@given(seed=st.integers(0, 2**32 - 1))
def test_no_limit_is_exceeded_whatever_is_asked_for(arm: Arm, seed: int) -> None:
    rng = np.random.default_rng(seed)
    controller = controller_of(arm)
    controller.start_from(np.zeros((arm.n_sections, 3)))
    before, rates = controller.lengths_m, controller._chambers.rates_m_s
    for _ in range(6):
        controller.set_target(garbage(arm, rng))
        for _ in range(int(rng.integers(1, 25))):  # the next one comes at full speed
            controller.step(DT_S)
            rates = assert_within_limits(arm, before, controller.lengths_m, rates)
            before = controller.lengths_m


@pytest.mark.parametrize("law", [LawName.QP_IK, LawName.RESOLVED_RATE])
@pytest.mark.parametrize("poison", [np.nan, np.inf])
def test_not_a_number_holds_and_poisons_nothing(law: LawName, poison: float) -> None:
    arm = paper_arm()
    controller, fresh = (starting_at(arm, arm.rest_lengths_m) for _ in range(2))
    good = PositionTarget(np.array([0.03, 0.01, 0.21]), law)
    for target in (
        PositionTarget(np.array([0.0, poison, 0.2]), law),
        LengthsTarget(np.array([[0.2, poison, 0.2]]), law),
        TwistTarget(np.array([poison, 0.0, 0.0]), None, False, False, law),
    ):
        controller.set_target(target)
        for _ in range(20):
            controller.step(DT_S)
            np.testing.assert_array_equal(controller.lengths_m, arm.rest_lengths_m)
    for dt_s in (poison, 0.0, -1.0):
        controller.set_target(good)
        controller.step(dt_s)
        assert np.isfinite(controller.lengths_m).all()
    controller.start_from(np.zeros((1, 3)))
    run(arm, controller, good)
    run(arm, fresh, good)
    assert controller.reach == fresh.reach == Reach.REACHED
    np.testing.assert_allclose(controller.lengths_m, fresh.lengths_m, atol=1e-6)


@pytest.mark.parametrize("dt_s", [1e-4, 1e-3, 1e-2, 0.1, 0.5])
@pytest.mark.parametrize("gain_per_s", [5.0, 200.0])
def test_no_gain_and_no_period_makes_it_swing(dt_s: float, gain_per_s: float) -> None:
    controller = Controller(paper_arm(), replace(SETTINGS, gain_per_s=gain_per_s))
    target = np.array([0.06, -0.03, 0.2])
    controller.set_target(PositionTarget(target))
    errors = []
    for _ in range(int(4.0 / dt_s) if dt_s > 1e-3 else 3000):
        controller.step(dt_s)
        errors.append(controller.error_m)
    assert max(np.diff(errors)) < 2e-4
    assert errors[-1] < (1e-3 if dt_s > 1e-3 else 0.9 * errors[0])


@pytest.mark.parametrize("name", ["paper", "table1"])
def test_a_straight_line_stays_straight_under_rate_acceleration_and_slew(name: str) -> None:
    arm = replace(
        ARMS[name], sections=(replace(ARMS[name].sections[0], pressure_slew_max_pa_s=1.5e5),)
    )
    rng = np.random.default_rng(0)
    for _ in range(5):
        start, goal = random_lengths(arm, rng, 0.5), random_lengths(arm, rng, 0.5)
        first, last = (tip_transform(arm, lengths)[:3, 3] for lengths in (start, goal))
        controller = starting_at(arm, start)
        controller.set_target(PositionTarget(last))
        along = (last - first) / np.linalg.norm(last - first)
        for _ in range(400):
            tip = controller.step(DT_S).position_m - first
            assert np.linalg.norm(tip - (tip @ along) * along) < 0.05 * np.linalg.norm(last - first)
        assert controller.error_m < 1e-4


def test_braking_is_part_of_every_stop() -> None:
    controller = starting_at(paper_arm(), paper_arm().rest_lengths_m)
    controller.set_target(PositionTarget(np.array([0.08, 0.0, 0.25])))
    for _ in range(40):
        controller.step(DT_S)
    before, rates = controller.lengths_m, controller._chambers.rates_m_s
    assert np.abs(rates).max() > 0.05
    controller.set_target(None)
    for _ in range(20):
        controller.step(DT_S)
        rates = assert_within_limits(paper_arm(), before, controller.lengths_m, rates)
        before = controller.lengths_m
    assert not rates.any()


@pytest.mark.parametrize("name", ["wall", "ball"])
def test_the_arm_goes_up_to_a_keep_out_and_says_that_it_binds(name: str) -> None:
    arm = KEPT_OUT[name]
    controller = starting_at(arm, arm.rest_lengths_m)
    run(arm, controller, PositionTarget(np.array([0.09, 0.0, 0.17])))
    assert controller.reach == Reach.OUT_OF_REACH
    assert controller.binding() & KeepOutLimit.bit


def test_the_tip_slides_along_a_wall() -> None:
    arm = KEPT_OUT["wall"]
    controller = starting_at(arm, arm.rest_lengths_m)
    run(arm, controller, PositionTarget(np.array([0.12, 0.08, 0.18])))
    tip = tip_transform(arm, controller.lengths_m)[:3, 3]
    np.testing.assert_allclose(tip, [0.05, 0.08, 0.18], atol=2e-3)


def test_a_keep_out_in_the_arm_at_rest_and_bounds_that_exclude_each_other_are_refused() -> None:
    inside = replace(paper_arm(), keep_outs=(Sphere((0.02, 0.0, 0.1), 0.015),), body_radius_m=0.01)
    with pytest.raises(InvalidInput, match=r"keep_outs\[0\] contains a part of section 1"):
        refuse_contradictions(inside)
    refuse_contradictions(replace(inside, body_radius_m=0.0))
    section = replace(PAPER_SECTION, lengthening_m_per_pa=1e-15, softening_m_per_pa2=0.0)
    refuse_contradictions(Arm("still", (section,)))


def test_an_arm_inside_a_keep_out_may_leave_it_and_goes_no_deeper() -> None:
    arm = KEPT_OUT["wall"]
    bent = random_lengths(arm, np.random.default_rng(0), 0.2)
    bent[0] = [0.16, 0.24, 0.24]
    controller, keep_out = starting_at(arm, bent), KeepOutLimit(arm)
    left = keep_out.left_m(controller.lengths_m).min()
    assert left < -0.005
    for x in (0.09, 0.0):
        controller.set_target(PositionTarget(np.array([x, 0.0, 0.2])))
        for _ in range(400):
            controller.step(DT_S)
            now = keep_out.left_m(controller.lengths_m).min()
            assert now >= min(left, 0.0) - 1e-9
    assert now > 0.0

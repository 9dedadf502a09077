"""The controller: which law, what start, pressures and lengths, and what it says about reach."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.controller import Controller
from pneuarm.controllers.geometry.rotations import quaternion_from_rotation
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from pneuarm.controllers.laws.settings import ControlSettings
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.targets.targets import (
    LawName,
    LengthsTarget,
    PoseTarget,
    PositionTarget,
    PressuresTarget,
    Target,
    TwistTarget,
)
from tests.controllers.laws.driving import DT_S, SETTINGS, every_arm, run
from tools.rig.arms import paper_arm, random_lengths, table1_arm, trunk_arm

ORIGIN = np.zeros(3)
POSITION = PositionTarget(np.array([0.02, 0.01, 0.2]))
TWIST = TwistTarget(np.array([0.01, 0.0, 0.0]), None, False, False)

shared_controller = cache(lambda arm: Controller(arm, SETTINGS))  # compiling one takes long


@pytest.mark.parametrize(
    ("target", "law"),
    [
        (POSITION, LawName.QP_IK),
        (TWIST, LawName.RESOLVED_RATE),
        (PositionTarget(ORIGIN, LawName.RESOLVED_RATE), LawName.RESOLVED_RATE),
        (TwistTarget(ORIGIN, None, False, False, LawName.QP_IK), LawName.QP_IK),
        (LengthsTarget(paper_arm().rest_lengths_m), LawName.QP_IK),
    ],
)
def test_a_target_picks_its_law_and_else_the_default_applies(target: Target, law: LawName) -> None:
    controller = Controller(paper_arm(), SETTINGS)
    controller.set_target(target)
    assert controller.law_name == law


def test_the_default_law_is_a_setting() -> None:
    controller = Controller(paper_arm(), ControlSettings(default_law=LawName.RESOLVED_RATE))
    controller.set_target(POSITION)
    assert controller.law_name == LawName.RESOLVED_RATE


@every_arm
def test_without_a_target_nothing_moves(arm: Arm) -> None:
    controller = Controller(arm, SETTINGS)
    tip = controller.step(DT_S)
    np.testing.assert_array_equal(controller.lengths_m, arm.rest_lengths_m)
    np.testing.assert_array_equal(controller.pressures_pa(), np.zeros((arm.n_sections, 3)))
    np.testing.assert_allclose(tip.position_m, [0.0, 0.0, arm.total_rest_length_m], atol=1e-15)
    assert controller.reach == Reach.NONE


@every_arm
@given(seed=st.integers(0, 2**32 - 1))
def test_starting_from_measured_pressures_does_not_jump(arm: Arm, seed: int) -> None:
    lengths = random_lengths(arm, np.random.default_rng(seed))
    measured = PressureMap(arm).pressures_pa(lengths)
    controller = shared_controller(arm)
    controller.start_from(measured)
    controller.step(DT_S)
    np.testing.assert_allclose(controller.pressures_pa(), measured, atol=1e-6)


@every_arm
def test_starting_beyond_the_limits_starts_at_them(arm: Arm) -> None:
    controller = Controller(arm, SETTINGS)
    high = arm.per_chamber("pressure_max_pa")
    controller.start_from(high + 1e4)
    assert (controller.pressures_pa() <= high).all()
    assert (controller.lengths_m < arm.per_chamber("length_max_m")).all()
    controller.start_from(arm.per_chamber("pressure_min_pa") - 1e4)
    assert (controller.pressures_pa() >= arm.per_chamber("pressure_min_pa")).all()
    assert (controller.lengths_m > arm.per_chamber("length_min_m")).all()


def test_starting_again_forgets_the_target_and_what_was_said_of_it() -> None:
    controller = Controller(paper_arm(), SETTINGS)
    run(paper_arm(), controller, PositionTarget(np.array([0.0, 0.0, 0.5])))
    assert controller.reach == Reach.OUT_OF_REACH
    controller.start_from(np.zeros((1, 3)))
    assert controller.reach == Reach.NONE
    assert controller.error_m == 0.0
    controller.step(DT_S)
    np.testing.assert_array_equal(controller.lengths_m, paper_arm().rest_lengths_m)
    run(paper_arm(), controller, PositionTarget(np.array([0.0, 0.0, 0.5])))
    controller.start_from(controller.pressures_pa())  # where it stalled
    controller.set_target(PositionTarget(np.array([0.0, 0.0, 0.5])))
    controller.step(DT_S)
    assert controller.reach == Reach.MOVING  # it counts from the beginning again


@every_arm
def test_lengths_are_brought_to_their_target(arm: Arm) -> None:
    goal = random_lengths(arm, np.random.default_rng(0))
    controller = Controller(arm, SETTINGS)
    run(arm, controller, LengthsTarget(goal))
    assert controller.reach == Reach.REACHED
    np.testing.assert_allclose(controller.lengths_m, goal, atol=SETTINGS.reached_tolerance_m)


@every_arm
def test_pressures_are_brought_to_their_target(arm: Arm) -> None:
    goal = PressureMap(arm).pressures_pa(random_lengths(arm, np.random.default_rng(1)))
    controller = Controller(arm, SETTINGS)
    run(arm, controller, PressuresTarget(goal))
    assert controller.reach == Reach.REACHED
    for _ in range(400):  # from within the tolerance to the end
        controller.step(DT_S)
    np.testing.assert_allclose(controller.pressures_pa(), goal, atol=20.0)


def test_pressures_beyond_their_range_are_reached_at_the_range() -> None:
    arm = table1_arm()
    controller = Controller(arm, SETTINGS)
    run(arm, controller, PressuresTarget(np.full((1, 3), 5e5)))
    assert controller.reach == Reach.REACHED
    assert (controller.pressures_pa() <= 1.2e5).all()
    np.testing.assert_allclose(controller.pressures_pa(), 1.2e5, atol=2e3)


@pytest.mark.parametrize("seed", range(20))
def test_pressures_at_a_bound_never_exceed_it_by_a_bit(seed: int) -> None:
    """Else the guard would report an intervention for rounding, tick after tick."""
    rng = np.random.default_rng(seed)
    section = table1_arm().sections[0]
    values = {**vars(section), "pressure_max_pa": rng.uniform(1e4, 1.2e5)}
    arm = Arm("random", (type(section)(**values),))
    controller = Controller(arm, SETTINGS)
    controller.start_from(arm.per_chamber("pressure_max_pa"))
    assert (controller.pressures_pa() <= arm.per_chamber("pressure_max_pa")).all()
    controller.start_from(arm.per_chamber("pressure_min_pa"))
    assert (controller.pressures_pa() >= arm.per_chamber("pressure_min_pa")).all()


@pytest.mark.parametrize("law", [LawName.RESOLVED_RATE, LawName.QP_IK])
@every_arm
def test_a_pose_that_exists_is_reached(arm: Arm, law: LawName) -> None:
    rng = np.random.default_rng(2)
    for _ in range(4):
        controller = Controller(arm, SETTINGS)
        goal = tip_transform(arm, random_lengths(arm, rng, 0.7))
        run(arm, controller, PoseTarget(goal[:3, 3], quaternion_from_rotation(goal[:3, :3]), law))
        assert controller.reach == Reach.REACHED
        reached = tip_transform(arm, controller.lengths_m)
        np.testing.assert_allclose(reached[:3, 3], goal[:3, 3], atol=1e-3)
        np.testing.assert_allclose(reached[:3, :3], goal[:3, :3], atol=1.5e-2)


def test_the_tip_that_a_step_returns_is_the_one_of_the_commanded_lengths() -> None:
    controller = Controller(trunk_arm(), SETTINGS)
    controller.set_target(PositionTarget(np.array([0.1, 0.0, 0.3])))
    tip = controller.step(DT_S)
    expected = tip_transform(trunk_arm(), controller.lengths_m)[:3, 3]
    np.testing.assert_allclose(tip.position_m, expected, atol=1e-14)

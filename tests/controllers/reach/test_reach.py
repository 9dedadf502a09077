"""What the controller says of a target: moving, reached, out of reach, and which limit binds."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.controller import Controller
from pneuarm.controllers.limits.bend import BendLimit
from pneuarm.controllers.limits.length import LengthLimit
from pneuarm.controllers.limits.pressure import PressureLimit
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.targets.targets import LawName, PoseTarget, PositionTarget
from tests.controllers.laws.driving import DT_S, SETTINGS, every_arm, every_law, run, starting_at
from tools.rig.arms import PAPER_SECTION, paper_arm, random_lengths, table1_arm, trunk_arm


def without_vacuum() -> Arm:
    """Paper's arm, bound by its pressure when short and by Eq. (4) when long."""
    return Arm("no vacuum", (replace(PAPER_SECTION, pressure_min_pa=0.0),))


OUT_OF_REACH = [
    (paper_arm(), (0.0, 0.0, 0.5), LengthLimit.bit),
    (paper_arm(), (0.0, 0.0, 0.05), LengthLimit.bit),
    (paper_arm(), (0.19, 0.0, 0.0), BendLimit.bit),
    (table1_arm(), (0.0, 0.0, 0.5), PressureLimit.bit),
    (table1_arm(), (0.0, 0.0, 0.1), PressureLimit.bit),
    (trunk_arm(), (0.0, 0.0, 1.0), LengthLimit.bit),
]


@every_law
@pytest.mark.parametrize(("arm", "position", "binding"), OUT_OF_REACH)
def test_a_position_out_of_reach_is_said_to_be_so_with_the_limit_that_binds(
    arm: Arm, position: tuple[float, float, float], binding: int, law: LawName
) -> None:
    controller = starting_at(arm, arm.rest_lengths_m)
    run(arm, controller, PositionTarget(np.array(position), law))
    assert controller.reach == Reach.OUT_OF_REACH
    assert controller.binding() == binding
    assert controller.error_m > SETTINGS.reached_tolerance_m


@every_arm
@every_law
def test_the_tip_comes_to_rest_before_far_targets_in_any_direction(arm: Arm, law: LawName) -> None:
    if law == LawName.RESOLVED_RATE and arm.n_sections > 1:
        pytest.skip("along several limits at once the damped law creeps: the QP is for that")
    rng = np.random.default_rng(1)
    rested = 0
    for _ in range(5):
        controller = starting_at(arm, random_lengths(arm, rng))
        direction = rng.standard_normal(3)
        far = 1.2 * arm.max_length_m * direction / np.linalg.norm(direction)
        run(arm, controller, PositionTarget(far, law))
        rested += controller.reach == Reach.OUT_OF_REACH
        assert controller.binding() != 0
    assert rested >= 4  # a sideways drift of less than the tip speed may go on


def test_a_pose_that_one_section_cannot_have_is_out_of_reach_without_any_limit() -> None:
    controller = Controller(paper_arm(), SETTINGS)
    quarter_about_z = np.array([0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)])
    run(paper_arm(), controller, PoseTarget(np.array([0.0, 0.0, 0.22]), quarter_about_z))
    assert controller.reach == Reach.OUT_OF_REACH
    assert controller.binding() == 0


@pytest.mark.parametrize(
    ("arm", "change", "binding"),
    [
        (paper_arm(), (0.0, 0.0, 0.0), 0),
        (paper_arm(), (0.2, 0.0, 0.0), LengthLimit.bit),
        (paper_arm(), (-0.095, -0.095, -0.2), LengthLimit.bit),
        (paper_arm(), (0.09, -0.09, -0.09), BendLimit.bit),
        (without_vacuum(), (0.0, 0.01, 0.01), PressureLimit.bit),
        (without_vacuum(), (0.2, 0.1, 0.1), LengthLimit.bit),
        (table1_arm(), (0.0, 0.01, 0.01), PressureLimit.bit),
        (table1_arm(), (0.01, 0.01, 0.2), PressureLimit.bit),
        (table1_arm(), (0.01, 0.01, 0.01), 0),
    ],
)
def test_the_binding_limits_are_those_that_the_lengths_touch(
    arm: Arm, change: tuple[float, float, float], binding: int
) -> None:
    controller = Controller(arm, SETTINGS)
    wanted = arm.rest_lengths_m + np.array([change])
    controller.start_from(PressureMap(arm).pressures_pa(wanted))
    assert controller.binding() == binding


def test_one_section_at_its_limit_is_enough_to_be_reported() -> None:
    arm = trunk_arm()
    controller = Controller(arm, SETTINGS)
    pressures = np.zeros((3, 3))
    pressures[2, :] = 0.9e5
    controller.start_from(pressures)
    assert controller.binding() == LengthLimit.bit


def test_a_target_repeated_every_tick_is_followed_as_one_given_once() -> None:
    once, repeated = Controller(paper_arm(), SETTINGS), Controller(paper_arm(), SETTINGS)
    far = PositionTarget(np.array([0.05, 0.0, 0.6]))
    once.set_target(far)
    for _ in range(1000):
        repeated.set_target(far)
        once.step(DT_S)
        repeated.step(DT_S)
    np.testing.assert_array_equal(once.lengths_m, repeated.lengths_m)
    assert once.reach == repeated.reach == Reach.OUT_OF_REACH


def test_a_new_target_leaves_a_stall_behind() -> None:
    controller = Controller(paper_arm(), SETTINGS)
    run(paper_arm(), controller, PositionTarget(np.array([0.0, 0.0, 0.5])))
    assert controller.reach == Reach.OUT_OF_REACH
    near = PositionTarget(np.array([0.02, 0.01, 0.2]))
    controller.set_target(near)
    controller.step(DT_S)
    assert controller.reach == Reach.MOVING
    run(paper_arm(), controller, near)
    assert controller.reach == Reach.REACHED


@pytest.mark.parametrize(
    ("position", "time_of", "said"),
    [
        ((0.0, 0.0, 0.2), lambda: SETTINGS.settled_time_s, Reach.REACHED),
        ((0.0, 0.0, 0.5), lambda: SETTINGS.stalled_time_s, Reach.OUT_OF_REACH),
    ],
)
def test_near_or_still_counts_only_after_its_time_without_a_break(
    position: tuple[float, float, float], time_of: Callable[[], float], said: Reach
) -> None:
    controller = starting_at(paper_arm(), paper_arm().rest_lengths_m)
    target = PositionTarget(np.array(position))
    run(paper_arm(), controller, target)  # until it is said for the first time
    assert controller.reach == said
    away = PositionTarget(np.array([0.05, 0.0, 0.2]))
    for break_first in (True, False):
        if break_first:
            controller.set_target(away)
            for _ in range(5):
                controller.step(DT_S)
                assert controller.reach == Reach.MOVING
        controller.start_from(controller.pressures_pa())
        controller.set_target(target)
        verdicts: list[Reach] = []
        while not verdicts or verdicts[-1] == Reach.MOVING:
            assert len(verdicts) < 1000
            controller.step(DT_S)
            verdicts.append(controller.reach)
        assert verdicts[-1] == said
        assert len(verdicts) >= round(time_of() / DT_S)
    assert len(verdicts) == pytest.approx(time_of() / DT_S, abs=1)  # it was there all the time


@pytest.mark.parametrize(("share", "said"), [(0.99, Reach.REACHED), (1.01, Reach.OUT_OF_REACH)])
def test_reached_means_within_the_tolerance_and_no_further(share: float, said: Reach) -> None:
    controller = Controller(paper_arm(), replace(SETTINGS, gain_per_s=0.0))  # stands still
    offset = share * SETTINGS.reached_tolerance_m
    run(paper_arm(), controller, PositionTarget(np.array([0.0, offset, 0.2])))
    assert controller.reach == said

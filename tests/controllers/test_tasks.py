"""Every task: Jacobian by finite differences, rate by its meaning, no error at the goal."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.arm import Arm, Array
from controllers.kinematics.compiled import CompiledKinematics, TipState
from controllers.tasks.chamber_lengths import ChamberLengths
from controllers.tasks.task import Task, limited
from controllers.tasks.tip_pose import ORIENTATION_LENGTH_M, TipPose
from controllers.tasks.tip_position import TipPosition
from controllers.tasks.tip_twist import TipTwist
from tests.arms import ARMS, random_lengths, trunk_arm

GAIN_PER_S = 30.0
NO_SPEED_LIMIT = 1e9
STEP_M = 1e-6

GOALS = ["position", "pose", "lengths"]


compiled = cache(CompiledKinematics)  # compiling takes longer than all the rest


def frozen(arm: Arm, lengths: Array) -> TipState:
    """Tip state that the next evaluation does not overwrite."""
    tip = compiled(arm).evaluate(lengths)
    return TipState(tip.position_m.copy(), tip.rotation.copy(), tip.jacobian.copy())


def task_with_goal(kind: str, arm: Arm, goal: Array) -> Task:
    tip = frozen(arm, goal)
    if kind == "position":
        return TipPosition(tip.position_m, GAIN_PER_S, NO_SPEED_LIMIT)
    if kind == "pose":
        return TipPose(tip.position_m, tip.rotation, GAIN_PER_S, NO_SPEED_LIMIT)
    return ChamberLengths(goal, GAIN_PER_S)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@pytest.mark.parametrize("kind", GOALS)
@given(seed=st.integers(0, 2**32 - 1))
def test_at_the_goal_there_is_no_error_and_nothing_to_do(kind: str, arm: Arm, seed: int) -> None:
    goal = random_lengths(arm, np.random.default_rng(seed))
    task = task_with_goal(kind, arm, goal)
    tip = frozen(arm, goal)
    assert task.error_m(tip, goal) == pytest.approx(0.0, abs=1e-15)
    rate, _ = task.rate_and_jacobian(tip, goal)
    np.testing.assert_allclose(rate, 0.0, atol=1e-13)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@pytest.mark.parametrize("kind", GOALS)
@pytest.mark.parametrize("seed", range(5))
def test_the_jacobian_is_how_a_step_shrinks_what_is_wanted(kind: str, arm: Arm, seed: int) -> None:
    """``rate = gain error`` and ``J dq`` is the motion, so ``d rate = -gain J dq`` at the goal."""
    goal = random_lengths(arm, np.random.default_rng(seed))
    task = task_with_goal(kind, arm, goal)
    _, jacobian = task.rate_and_jacobian(frozen(arm, goal), goal)
    numerical = []
    for step in STEP_M * np.eye(arm.n_chambers):
        ahead, behind = goal + step.reshape(goal.shape), goal - step.reshape(goal.shape)
        rate_ahead, _ = task.rate_and_jacobian(frozen(arm, ahead), ahead)
        rate_behind, _ = task.rate_and_jacobian(frozen(arm, behind), behind)
        numerical.append((rate_ahead - rate_behind) / (-2.0 * STEP_M * GAIN_PER_S))
    np.testing.assert_allclose(jacobian, np.array(numerical).T, atol=1e-7)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@pytest.mark.parametrize("kind", GOALS)
@pytest.mark.parametrize("seed", range(5))
def test_a_small_step_along_the_wanted_rate_comes_closer(kind: str, arm: Arm, seed: int) -> None:
    rng = np.random.default_rng(seed)
    start = random_lengths(arm, rng, share=0.8)
    goal = start + 0.002 * rng.standard_normal(start.shape)
    task = task_with_goal(kind, arm, goal)
    tip = frozen(arm, start)
    rate, jacobian = task.rate_and_jacobian(tip, start)
    step = 1e-3 * np.linalg.pinv(jacobian) @ rate
    after = start + step.reshape(start.shape)
    assert task.error_m(frozen(arm, after), after) < task.error_m(tip, start)


@pytest.mark.parametrize("kind", ["position", "pose"])
def test_the_wanted_speed_is_limited_and_keeps_its_direction(kind: str) -> None:
    arm = trunk_arm()
    rng = np.random.default_rng(0)
    start, goal = random_lengths(arm, rng), random_lengths(arm, rng)
    free = task_with_goal(kind, arm, goal)
    slow = replace(free, speed_max_m_s=0.1)  # type: ignore[type-var]
    fast_rate, _ = free.rate_and_jacobian(frozen(arm, start), start)
    slow_rate, _ = slow.rate_and_jacobian(frozen(arm, start), start)
    assert np.linalg.norm(fast_rate) > 0.1
    assert np.linalg.norm(slow_rate) == pytest.approx(0.1)
    np.testing.assert_allclose(slow_rate / 0.1, fast_rate / np.linalg.norm(fast_rate))


def test_the_error_of_a_position_is_the_distance() -> None:
    arm = trunk_arm()
    tip = frozen(arm, arm.rest_lengths_m)
    task = TipPosition(tip.position_m + np.array([0.03, 0.0, -0.04]), GAIN_PER_S, NO_SPEED_LIMIT)
    assert task.error_m(tip, arm.rest_lengths_m) == pytest.approx(0.05)


def test_the_error_of_a_pose_counts_a_radian_as_its_length() -> None:
    arm = trunk_arm()
    tip = frozen(arm, arm.rest_lengths_m)
    c, s = np.cos(0.4), np.sin(0.4)
    turned = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    task = TipPose(tip.position_m, turned, GAIN_PER_S, NO_SPEED_LIMIT)
    assert task.error_m(tip, arm.rest_lengths_m) == pytest.approx(0.4 * ORIENTATION_LENGTH_M)
    rate, _ = task.rate_and_jacobian(tip, arm.rest_lengths_m)
    expected = np.array([0.0, 0.0, 0.0, 0.0, 0.4 * GAIN_PER_S * ORIENTATION_LENGTH_M, 0.0])
    np.testing.assert_allclose(rate, expected, atol=1e-12)


def test_the_error_of_lengths_is_the_worst_chamber() -> None:
    arm = trunk_arm()
    goal = arm.rest_lengths_m.copy()
    goal[1, 2] += 0.007
    goal[2, 0] -= 0.004
    error = ChamberLengths(goal, GAIN_PER_S).error_m(frozen(arm, goal), arm.rest_lengths_m)
    assert error == pytest.approx(0.007)


def wanted_twist(in_tip_frame: bool, about_base_origin: bool) -> tuple[TipState, Array]:
    """Tip state and the twist (v at the tip, omega) in the base frame, that the rows ask for."""
    arm = trunk_arm()
    lengths = random_lengths(arm, np.random.default_rng(5))
    tip = frozen(arm, lengths)
    task = TipTwist(
        np.array([0.01, 0.02, 0.03]), np.array([0.1, -0.2, 0.3]), in_tip_frame, about_base_origin
    )
    rate, jacobian = task.rate_and_jacobian(tip, lengths)
    np.testing.assert_array_equal(jacobian[:3], tip.jacobian[:3])
    np.testing.assert_allclose(jacobian[3:], ORIENTATION_LENGTH_M * tip.jacobian[3:])
    assert task.error_m(tip, lengths) == 0.0
    return tip, np.concatenate([rate[:3], rate[3:] / ORIENTATION_LENGTH_M])


@pytest.mark.parametrize("about_base_origin", [False, True])
@pytest.mark.parametrize("in_tip_frame", [False, True])
def test_a_twist_is_the_motion_of_the_body_point_at_the_reference(
    in_tip_frame: bool, about_base_origin: bool
) -> None:
    tip, twist = wanted_twist(in_tip_frame, about_base_origin)
    frame = tip.rotation if in_tip_frame else np.eye(3)
    np.testing.assert_allclose(twist[3:], frame @ [0.1, -0.2, 0.3])
    reference = np.zeros(3) if about_base_origin else tip.position_m
    # Rigid body: the point at the reference moves with v_tip + omega x (reference - tip).
    point = twist[:3] + np.cross(twist[3:], reference - tip.position_m)
    np.testing.assert_allclose(point, frame @ [0.01, 0.02, 0.03], atol=1e-15)


@pytest.mark.parametrize("in_tip_frame", [False, True])
def test_a_twist_without_angular_part_asks_for_three_rows(in_tip_frame: bool) -> None:
    arm = trunk_arm()
    lengths = random_lengths(arm, np.random.default_rng(6))
    tip = frozen(arm, lengths)
    linear = np.array([0.01, 0.02, 0.03])
    rate, jacobian = TipTwist(linear, None, in_tip_frame, False).rate_and_jacobian(tip, lengths)
    np.testing.assert_allclose(rate, (tip.rotation if in_tip_frame else np.eye(3)) @ linear)
    np.testing.assert_array_equal(jacobian, tip.jacobian[:3])


def test_a_vector_within_its_limit_is_returned_as_it_is() -> None:
    vector = np.array([3.0, 4.0])
    np.testing.assert_array_equal(limited(vector, 5.0), vector)
    np.testing.assert_allclose(limited(vector, 2.5), [1.5, 2.0])
    np.testing.assert_array_equal(limited(np.zeros(3), 0.0), np.zeros(3))

"""Every task: Jacobian by finite differences, rate by its meaning, no error at the goal."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.geometry.rotations import (
    rotation_from_quaternion,
)
from pneuarm.controllers.kinematics.constant_curvature import tip_transform as tip_of
from pneuarm.controllers.laws.commanded_chambers import CommandedChambers
from pneuarm.controllers.targets.targets import (
    LengthsTarget,
    PositionTarget,
    TasksTarget,
)
from tests.controllers.targets.asking import pose_of, rows_at, task_with_goal
from tools.rig.arms import ARMS, random_lengths, trunk_arm

STEP_M = 1e-6
GOALS = ["position", "pose", "direction", "point", "lengths", "combined"]
SEEDS = st.integers(0, 2**32 - 1)
LINEAR, ANGULAR = np.array([0.01, 0.02, 0.03]), np.array([0.1, -0.2, 0.3])

AXES = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0, -0.8), (0.6, 0.64, 0.48)]

every_arm = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
every_goal = pytest.mark.parametrize("kind", GOALS)


@every_arm
@every_goal
@settings(max_examples=8)
@given(seed=SEEDS)
def test_at_the_goal_there_is_no_error_and_nothing_to_do(kind: str, arm: Arm, seed: int) -> None:
    goal = random_lengths(arm, np.random.default_rng(seed))
    rows = rows_at(arm, goal, task_with_goal(kind, arm, goal))
    assert rows.error_m == pytest.approx(0.0, abs=1e-13)
    np.testing.assert_allclose(rows.error, 0.0, atol=1e-13)


@every_arm
@every_goal
@settings(max_examples=8)
@given(seed=SEEDS)
def test_the_jacobian_is_how_a_step_shrinks_the_error(kind: str, arm: Arm, seed: int) -> None:
    """``J dq`` is the motion, so ``d error = -J dq`` at the goal; the chambers' is the identity."""
    goal = random_lengths(arm, np.random.default_rng(seed))
    task = task_with_goal(kind, arm, goal)
    numerical = []
    for step in STEP_M * np.eye(arm.n_chambers):
        ahead, behind = goal + step.reshape(goal.shape), goal - step.reshape(goal.shape)
        change = rows_at(arm, ahead, task).error - rows_at(arm, behind, task).error
        numerical.append(change / (-2.0 * STEP_M))
    jacobian = rows_at(arm, goal, task).jacobian
    np.testing.assert_allclose(jacobian, np.array(numerical).T, atol=1e-6)
    assert jacobian.any() == (kind != "lengths")


@every_arm
@every_goal
@pytest.mark.parametrize("seed", range(3))
def test_following_a_task_comes_closer(kind: str, arm: Arm, seed: int) -> None:
    rng = np.random.default_rng(seed)
    start = random_lengths(arm, rng, share=0.8)
    goal = start + 0.002 * rng.standard_normal(start.shape)
    motion = motion_of(arm)
    motion.place(start)
    motion.ask(task_with_goal(kind, arm, goal), 30.0, 0.3)
    motion.place_tip()
    before = motion.error_m
    for _ in range(40):
        motion.step(motion.qp_ik, 5e-3)
    assert motion.error_m < 0.1 * before


motion_of = cache(CommandedChambers)


@every_arm
@given(seed=SEEDS)
def test_a_correction_moves_and_turns_the_tip_that_is_seen(arm: Arm, seed: int) -> None:
    rng = np.random.default_rng(seed)
    lengths, correction = random_lengths(arm, rng), np.eye(4)
    quaternion = rng.standard_normal(4)
    correction[:3, :3] = rotation_from_quaternion(quaternion / np.linalg.norm(quaternion))
    correction[:3, 3] = 0.05 * rng.standard_normal(3)
    tip = tip_of(arm, lengths)
    task = pose_of(tip[:3, 3] + correction[:3, 3], correction[:3, :3] @ tip[:3, :3])
    rows = rows_at(arm, lengths, task, correction)
    assert rows.error_m == pytest.approx(0.0, abs=1e-9)
    plain = rows_at(arm, lengths, task).jacobian
    np.testing.assert_allclose(rows.jacobian[:3], plain[:3], atol=1e-12)
    np.testing.assert_allclose(rows.jacobian[3:6], correction[:3, :3] @ plain[3:6], atol=1e-12)


def test_a_position_that_moves_is_followed_without_lag() -> None:
    arm, velocity, dt_s = ARMS["paper"], np.array([0.04, 0.02, 0.01]), 1e-3
    motion = motion_of(arm)
    motion.place(arm.rest_lengths_m)
    position = motion.tip.position_m.copy()
    errors = []
    for _ in range(1000):
        motion.ask(PositionTarget(position, velocity_m_s=velocity), 30.0, 0.3)
        motion.step(motion.qp_ik, dt_s)
        position = position + velocity * dt_s
        errors.append(float(np.linalg.norm(position - motion.tip.position_m)))
    assert max(errors[300:]) < 2e-4  # without the velocity: 1.5 mm behind
    assert max(errors) < 5e-3


def test_posture_uses_what_the_tip_leaves_and_the_tip_stands_still() -> None:
    arm = trunk_arm()
    rng = np.random.default_rng(3)
    motion = motion_of(arm)
    middle = 0.5 * sum(length_bounds_m(arm))
    for _ in range(3):
        start = random_lengths(arm, rng, 0.7)
        motion.place(start)
        tip = motion.tip.position_m.copy()
        motion.ask(PositionTarget(tip), 30.0, 0.3)
        for _ in range(1500):
            motion.step(motion.qp_ik, 5e-3)
            assert np.linalg.norm(motion.tip.position_m - tip) < 1e-4
        before, after = np.abs(start - middle), np.abs(motion.lengths_m - middle)
        assert (after**2).sum() < 0.8 * (before**2).sum()
        assert motion.error_m < 1e-6


def test_weights_decide_the_compromise_between_tasks() -> None:
    arm = ARMS["paper"]
    first, second = np.array([0.03, 0.0, 0.2]), arm.rest_lengths_m
    distances = []
    for weight in (0.1, 1.0, 10.0):
        motion = motion_of(arm)
        motion.place(second)
        both = PositionTarget(first, weight=weight), LengthsTarget(second)
        motion.ask(TasksTarget(both), 30.0, 0.3)
        for _ in range(300):
            motion.step(motion.qp_ik, 5e-3)
        distances.append(float(np.linalg.norm(first - motion.tip.position_m)))
    assert distances[0] > 1.5 * distances[1] > 4.0 * distances[2]

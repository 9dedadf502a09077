"""Every task: Jacobian by finite differences, rate by its meaning, no error at the goal."""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.geometry.rotations import (
    quaternion_from_rotation,
    rotation_from_quaternion,
)
from pneuarm.controllers.kinematics.constant_curvature import (
    section_transforms,
    shapes_from_lengths,
)
from pneuarm.controllers.kinematics.constant_curvature import tip_transform as tip_of
from pneuarm.controllers.laws.commanded_chambers import CommandedChambers
from pneuarm.controllers.targets.targets import (
    PARTS,
    ROWS,
    DirectionTarget,
    LengthsTarget,
    PointTarget,
    PoseTarget,
    PositionTarget,
    PostureTarget,
    Target,
    TasksTarget,
    TwistTarget,
)
from pneuarm.controllers.tasks.rows import Rows, symbolic_rows
from pneuarm.controllers.tasks.wanted import ORIENTATION_LENGTH_M, Wanted, symbols
from tools.rig.arms import ARMS, random_lengths, trunk_arm

STEP_M = 1e-6
GOALS = ["position", "pose", "direction", "point", "lengths", "combined"]
SEEDS = st.integers(0, 2**32 - 1)
LINEAR, ANGULAR = np.array([0.01, 0.02, 0.03]), np.array([0.1, -0.2, 0.3])

AXES = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0, -0.8), (0.6, 0.64, 0.48)]

every_arm = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
every_goal = pytest.mark.parametrize("kind", GOALS)


@cache
def compiled(arm: Arm) -> ca.Function:
    lengths = ca.SX.sym("lengths", arm.n_chambers)
    vector, want = symbols(arm.n_chambers, PARTS)
    rows = symbolic_rows(arm, lengths, want, ROWS, whole=True)
    return ca.Function("rows", [lengths, vector], ca.cse(list(rows)))


def rows_at(arm: Arm, lengths: Array, task: Target, correction: Array | None = None) -> Rows:
    """Rows of a task as numpy arrays; vectors are flat."""
    wanted = Wanted(arm.n_chambers, PARTS)
    task.ask(wanted, 30.0, 1.0)
    if correction is not None:
        wanted.correct(correction[:3, 3], correction[:3, :3])
    results = [np.array(part) for part in compiled(arm)(lengths.reshape(-1), wanted.values)]
    return Rows(*(part.reshape(-1) if part.shape[1] == 1 else part for part in results))


def point_at(arm: Arm, lengths: Array, station: float) -> Array:
    """Position of a backbone's point, the slow way."""
    transform = np.eye(4)
    shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))
    for index, shape in enumerate(shapes):
        share = np.clip(station * arm.n_sections - index, 0.0, 1.0)
        transform = transform @ section_transforms(share * shape)
    return transform[:3, 3]


def pose_of(position_m: Array, rotation: Array) -> PoseTarget:
    return PoseTarget(position_m, quaternion_from_rotation(rotation))


def task_with_goal(kind: str, arm: Arm, goal: Array) -> Target:
    tip = tip_of(arm, goal)
    point = PointTarget(point_at(arm, goal, 0.6), 0.6, weight=2.0)
    match kind:
        case "position":
            return PositionTarget(tip[:3, 3])
        case "pose":
            return PoseTarget(
                tip[:3, 3],
                quaternion_from_rotation(tip[:3, :3]),
                weight=2.0,
                orientation_weight=0.5,
            )
        case "direction":
            return DirectionTarget(tip[:3, 2], weight=3.0)
        case "point":
            return point
        case "combined":
            direction = DirectionTarget(tip[:3, 2], weight=0.3)
            return TasksTarget((PositionTarget(tip[:3, 3]), direction, point))
    return LengthsTarget(goal)


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


def test_the_error_of_a_position_is_the_distance() -> None:
    arm = trunk_arm()
    tip = tip_of(arm, arm.rest_lengths_m)[:3, 3]
    task = PositionTarget(tip + np.array([0.03, 0.0, -0.04]), weight=7.0)
    assert rows_at(arm, arm.rest_lengths_m, task).error_m == pytest.approx(0.05)


@pytest.mark.parametrize("angle", [1e-12, 1e-6, 0.4, 3.0, np.pi - 1e-9, np.pi])
@pytest.mark.parametrize(
    "axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0, -0.8), (0.6, 0.64, 0.48)]
)
def test_the_error_of_a_pose_is_the_angle_times_its_length(
    angle: float, axis: tuple[float, ...]
) -> None:
    arm, vector = trunk_arm(), np.array(axis)
    tip = tip_of(arm, arm.rest_lengths_m)
    quaternion = np.append(np.sin(0.5 * angle) * vector, np.cos(0.5 * angle))
    task = pose_of(tip[:3, 3], rotation_from_quaternion(quaternion) @ tip[:3, :3])
    rows = rows_at(arm, arm.rest_lengths_m, task)
    turn = rows.error[3:6] / ORIENTATION_LENGTH_M
    assert rows.error_m == pytest.approx(ORIENTATION_LENGTH_M * angle, abs=1e-9)
    sign = np.sign(turn @ vector) if angle > 3.1 else 1.0  # half a turn goes either way
    np.testing.assert_allclose(sign * turn, angle * vector, atol=2e-7)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.7, 3.0, np.pi])
def test_the_error_of_a_direction_is_the_angle_and_roll_is_free(angle: float) -> None:
    arm = trunk_arm()
    direction = np.array([np.sin(angle), 0.0, np.cos(angle)])
    rows = rows_at(arm, arm.rest_lengths_m, DirectionTarget(direction))
    assert rows.error_m == pytest.approx(ORIENTATION_LENGTH_M * angle, abs=1e-9)
    np.testing.assert_allclose(rows.jacobian[5], 0.0, atol=1e-15)  # about its own axis


def test_the_error_of_lengths_is_the_worst_chamber() -> None:
    arm = trunk_arm()
    goal = arm.rest_lengths_m.copy()
    goal[1, 2] += 0.007
    goal[2, 0] -= 0.004
    rows = rows_at(arm, arm.rest_lengths_m, LengthsTarget(goal))
    assert rows.error_m == pytest.approx(0.007)


@every_arm
@given(seed=SEEDS, station=st.floats(0.0, 1.0))
def test_a_point_of_the_backbone_is_where_it_is(arm: Arm, seed: int, station: float) -> None:
    lengths = random_lengths(arm, np.random.default_rng(seed))
    wanted = np.array([0.01, -0.02, 0.03])
    rows = rows_at(arm, lengths, PointTarget(wanted, station))
    np.testing.assert_allclose(rows.error[6:], wanted - point_at(arm, lengths, station), atol=1e-13)


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


@pytest.mark.parametrize("about_base_origin", [False, True])
@pytest.mark.parametrize("in_tip_frame", [False, True])
def test_a_twist_is_the_motion_of_the_body_point_at_the_reference(
    in_tip_frame: bool, about_base_origin: bool
) -> None:
    arm = trunk_arm()
    lengths = random_lengths(arm, np.random.default_rng(5))
    tip = tip_of(arm, lengths)
    rows = rows_at(arm, lengths, TwistTarget(LINEAR, ANGULAR, in_tip_frame, about_base_origin))
    frame = tip[:3, :3] if in_tip_frame else np.eye(3)
    spin = rows.velocity[3:6] / ORIENTATION_LENGTH_M
    np.testing.assert_allclose(spin, frame @ ANGULAR)
    reference = np.zeros(3) if about_base_origin else tip[:3, 3]
    # Rigid body: the point at the reference moves with v_tip + omega x (reference - tip).
    point = rows.velocity[:3] + np.cross(spin, reference - tip[:3, 3])
    np.testing.assert_allclose(point, frame @ LINEAR, atol=1e-15)
    np.testing.assert_array_equal(rows.error, 0.0)
    assert rows.error_m == 0.0


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


def test_posture_alone_asks_for_nothing_else() -> None:
    wanted = Wanted(9, PARTS)
    PostureTarget(weight=0.5).ask(wanted, 30.0, 0.3)
    assert wanted["posture_weight"] == 0.5
    assert not wanted["position_weight"].any()


@given(seed=SEEDS)
def test_a_quaternion_and_its_rotation_are_the_same(seed: int) -> None:
    quaternion = np.random.default_rng(seed).standard_normal(4)
    quaternion /= np.copysign(np.linalg.norm(quaternion), quaternion[3])
    found = quaternion_from_rotation(rotation_from_quaternion(quaternion))
    np.testing.assert_allclose(found, quaternion, atol=1e-12)

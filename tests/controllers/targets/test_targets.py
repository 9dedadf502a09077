"""Every kind of target asks for what it says: its error, its rate, and nothing else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.geometry.rotations import (
    rotation_from_quaternion,
)
from pneuarm.controllers.kinematics.constant_curvature import tip_transform as tip_of
from pneuarm.controllers.targets.targets import (
    PARTS,
    DirectionTarget,
    LengthsTarget,
    PointTarget,
    PositionTarget,
    PostureTarget,
    TwistTarget,
)
from pneuarm.controllers.tasks.wanted import ORIENTATION_LENGTH_M, Wanted
from tests.controllers.targets.asking import point_at, pose_of, rows_at
from tools.rig.arms import ARMS, random_lengths, trunk_arm

SEEDS = st.integers(0, 2**32 - 1)
LINEAR, ANGULAR = np.array([0.01, 0.02, 0.03]), np.array([0.1, -0.2, 0.3])

every_arm = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)


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


def test_posture_alone_asks_for_nothing_else() -> None:
    wanted = Wanted(9, PARTS)
    PostureTarget(weight=0.5).ask(wanted, 30.0, 0.3)
    assert wanted["posture_weight"] == 0.5
    assert not wanted["position_weight"].any()

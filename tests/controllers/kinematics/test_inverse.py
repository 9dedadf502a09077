"""Inverse of the whole configuration: what forward gave comes back, and what is missing is told."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.kinematics import inverse as inverse_module
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths, tip_transform
from pneuarm.controllers.kinematics.inverse import (
    Inverse,
    inverse,
    pose_error,
    rotation_vectors,
    within_limits,
)
from pneuarm.controllers.kinematics.parameters import in_frame
from pneuarm.controllers.limits.bend import BendLimit
from tools.rig.arms import ARMS, PAPER_SECTION, paper_arm, random_lengths, trunk_arm

#: Bends as far as the box of Eq. (4) goes.
WIDE = Arm("wide", (replace(PAPER_SECTION, bend_max_rad=6.0),))
LENGTHS = st.tuples(*3 * [st.floats(0.1001, 0.2999)]).map(lambda lengths: np.array([lengths]))


def about(axis: int, angle_rad: float) -> np.ndarray:
    transform = np.eye(4)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    transform[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return transform


def shifted(transform: np.ndarray, offset_m: tuple[float, float, float]) -> np.ndarray:
    moved = transform.copy()
    moved[:3, 3] += offset_m
    return moved


@given(LENGTHS)
def test_one_section_comes_back_exactly(lengths: np.ndarray) -> None:
    found = inverse(WIDE, tip_transform(WIDE, lengths))
    np.testing.assert_allclose(found.lengths_m, lengths, rtol=0.0, atol=1e-12)
    assert found.position_residual_m < 1e-12
    assert found.rotation_residual_rad < 1e-12


@pytest.mark.parametrize("asymmetry_m", [0.0, 1e-15, 1e-12, 1e-9, 1e-6])
@pytest.mark.parametrize("frame", ["twist_free", "paper"])
def test_nearly_straight_poses_are_like_any_other(asymmetry_m: float, frame: str) -> None:
    arm = paper_arm()
    lengths = np.array([[0.2 + asymmetry_m, 0.2, 0.2]])
    shape = shapes_from_lengths(lengths, 0.038)[0]
    pose = in_frame(tip_transform(arm, lengths), shape, frame)  # type: ignore[arg-type]
    found = inverse(arm, pose, frame)  # type: ignore[arg-type]
    np.testing.assert_allclose(found.lengths_m, lengths, rtol=0.0, atol=1e-12)
    # A bend of 1e-13 rad has a direction phi of which position alone keeps few digits.
    assert found.rotation_residual_rad < (1e-12 if frame == "twist_free" else 0.1)


@pytest.mark.parametrize("angle_rad", [1e-6, 0.1, 2.0, np.pi])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_turn_that_one_section_cannot_make_is_the_residual(axis: int, angle_rad: float) -> None:
    arm = paper_arm()
    lengths = random_lengths(arm, np.random.default_rng(1))
    found = inverse(arm, tip_transform(arm, lengths) @ about(axis, angle_rad))
    np.testing.assert_allclose(found.lengths_m, lengths, atol=1e-12)
    assert found.position_residual_m < 1e-12
    assert found.rotation_residual_rad == pytest.approx(angle_rad, abs=1e-9)


def test_a_straight_pose_beyond_the_longest_arm_is_missed_by_what_it_is_beyond() -> None:
    arm = paper_arm()
    far = shifted(np.eye(4), (0.0, 0.0, 0.35))
    found = inverse(arm, far)
    assert found.position_residual_m == pytest.approx(0.05, abs=1e-5)
    assert (found.lengths_m < 0.3).all()


@pytest.mark.parametrize("offset_m", [(0.0, 0.0, 0.0), (0.0, 0.0, -0.1), (0.3, 0.3, -0.3)])
@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_poses_out_of_reach_give_lengths_within_the_limits(
    arm: Arm, offset_m: tuple[float, float, float]
) -> None:
    found = inverse(arm, shifted(np.eye(4), offset_m))
    assert found.position_residual_m > 1e-3 or found.rotation_residual_rad > 1e-3
    assert (BendLimit(arm).left_m(found.lengths_m) > -1e-9).all()
    assert (found.lengths_m > arm.per_chamber("length_min_m")).all()
    assert (found.lengths_m < arm.per_chamber("length_max_m")).all()


@pytest.mark.parametrize("frame", ["twist_free", "paper"])
def test_three_sections_meet_the_poses_that_they_take(frame: str) -> None:
    arm = trunk_arm()
    rng = np.random.default_rng(2)
    lengths = np.stack([random_lengths(arm, rng, 0.9) for _ in range(20)])
    shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))[:, -1]
    poses = in_frame(tip_transform(arm, lengths), shapes, frame)  # type: ignore[arg-type]
    found = inverse(arm, poses, frame)  # type: ignore[arg-type]
    assert found.position_residual_m.max() < 1e-8
    assert found.rotation_residual_rad.max() < 1e-7
    tips = tip_transform(arm, found.lengths_m)
    np.testing.assert_allclose(tips[:, :3, 3], poses[:, :3, 3], atol=1e-8)


def test_the_residual_is_the_distance_that_is_left() -> None:
    arm = trunk_arm()
    far = shifted(np.eye(4), (0.0, 0.0, 0.6))  # the longest arm is 0.555 m
    found = inverse(arm, far)
    assert found.position_residual_m == pytest.approx(0.045, abs=1e-4)
    assert found.rotation_residual_rad == pytest.approx(0.0, abs=1e-3)


def test_a_batch_is_each_of_its_poses_and_gives_the_same_twice() -> None:
    arm = trunk_arm()
    rng = np.random.default_rng(3)
    lengths = np.stack([random_lengths(arm, rng, 0.8) for _ in range(4)]).reshape(2, 2, 3, 3)
    poses = tip_transform(arm, lengths)

    def close(one: Inverse, other: Inverse) -> None:
        np.testing.assert_allclose(one.position_residual_m, other.position_residual_m, atol=1e-9)

    together = inverse(arm, poses)
    assert together.lengths_m.shape == (2, 2, 3, 3)
    assert together.position_residual_m.shape == (2, 2)
    np.testing.assert_array_equal(inverse(arm, poses).lengths_m, together.lengths_m)
    close(
        inverse(arm, poses[1, 0]),
        Inverse(
            together.lengths_m[1, 0],
            together.position_residual_m[1, 0],
            together.rotation_residual_rad[1, 0],
        ),
    )


@given(st.floats(0.0, np.pi), st.floats(-1.0, 1.0), st.floats(-np.pi, np.pi))
def test_a_rotation_vector_is_axis_times_angle(angle: float, height: float, turn: float) -> None:
    radius = np.sqrt(1.0 - height**2)
    axis = np.array([radius * np.cos(turn), radius * np.sin(turn), height])
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    rotation = np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew
    vector = rotation_vectors(rotation)
    assert np.linalg.norm(vector) == pytest.approx(angle, abs=1e-7)
    difference = min(np.abs(vector - angle * axis).max(), np.abs(vector + angle * axis).max())
    assert difference < 1e-6 if angle > np.pi - 1e-6 else np.abs(vector - angle * axis).max() < 1e-6


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_limits_move_only_what_is_outside(arm: Arm) -> None:
    rng = np.random.default_rng(4)
    inside = random_lengths(arm, rng, 0.9)
    np.testing.assert_array_equal(within_limits(arm, inside), inside)
    outside = within_limits(arm, 3.0 * rng.uniform(size=(50, arm.n_sections, 3)))
    assert (outside > arm.per_chamber("length_min_m")).all()
    assert (outside < arm.per_chamber("length_max_m")).all()
    for lengths in outside:
        assert (BendLimit(arm).left_m(lengths) > -1e-12).all()


def cost(arm: Arm, lengths: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Distance (m), an angle counted as the arc of the arm's length."""
    error = pose_error(arm, lengths, np.broadcast_to(pose, (*lengths.shape[:-2], 4, 4)))
    return np.linalg.norm(error * np.repeat([1.0, arm.total_rest_length_m], 3), axis=-1)


@pytest.mark.parametrize("place_m", [(0.15, 0.05, -0.05), (0.0, -0.3, 0.2), (0.02, 0.0, 0.05)])
def test_out_of_reach_no_configuration_that_is_tried_is_nearer(
    place_m: tuple[float, float, float],
) -> None:
    arm = paper_arm()
    pose = shifted(np.eye(4), place_m)
    tried = np.random.default_rng(6).uniform(0.1, 0.3, (50_000, 1, 3))
    nearest = cost(arm, within_limits(arm, tried), pose).min()
    assert cost(arm, inverse(arm, pose).lengths_m, pose) < nearest


def test_a_pose_that_no_start_has_met_gets_more_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    arm = trunk_arm()
    rng = np.random.default_rng(7)
    poses = tip_transform(arm, np.stack([random_lengths(arm, rng) for _ in range(30)]))
    monkeypatch.setattr(inverse_module, "_STARTS", 2)
    met = []
    for rounds in (1, inverse_module._ROUNDS):
        monkeypatch.setattr(inverse_module, "_ROUNDS", rounds)
        met.append(np.count_nonzero(inverse(arm, poses).position_residual_m < 1e-9))
    assert met[0] < met[1]

"""The singularity-free form: round trips, the straight arm, chains and the derivative."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import (
    curve_transforms,
    lengths_from_shapes,
    section_end_transforms,
    section_inverse,
    section_transforms,
    shapes_from_lengths,
    tip_transform,
)
from tools.rig.arms import ARMS, paper_arm, random_lengths, trunk_arm

OFFSET_M = 0.038
LENGTHS = st.tuples(*3 * [st.floats(0.1, 0.3)]).map(np.array)
#: Differences between chambers down to where the closed form of the literature gives NaN.
ASYMMETRIES_M = (0.0, 1e-15, 1e-12, 1e-9, 1e-6)


@given(LENGTHS)
def test_lengths_come_back_from_their_shape(lengths: np.ndarray) -> None:
    shape = shapes_from_lengths(lengths, OFFSET_M)
    np.testing.assert_allclose(lengths_from_shapes(shape, OFFSET_M), lengths, atol=1e-16 * 4)


@given(LENGTHS)
def test_the_backbone_is_as_long_as_its_chambers_are_on_average(lengths: np.ndarray) -> None:
    assert shapes_from_lengths(lengths, OFFSET_M)[0] == pytest.approx(lengths.mean(), rel=1e-14)


@pytest.mark.parametrize(("chamber", "angle_deg"), [(0, 0.0), (1, 120.0), (2, 240.0)])
def test_an_arm_bends_toward_its_shortest_chamber(chamber: int, angle_deg: float) -> None:
    lengths = np.full(3, 0.2)
    lengths[chamber] -= 0.01
    _, u, v = shapes_from_lengths(lengths, OFFSET_M)
    direction = np.array([np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))])
    np.testing.assert_allclose(np.array([u, v]) / np.hypot(u, v), direction, atol=1e-12)
    x, y, _ = section_transforms(np.array([0.2, u, v]))[:3, 3]
    assert np.array([x, y]) @ direction > 0.0


@given(LENGTHS)
def test_the_inverse_of_one_section_gives_the_shape_back(lengths: np.ndarray) -> None:
    shape = shapes_from_lengths(lengths, OFFSET_M)
    tip = section_transforms(shape)[:3, 3]
    np.testing.assert_allclose(section_inverse(tip), shape, atol=1e-12)


@pytest.mark.parametrize("asymmetry_m", ASYMMETRIES_M)
@pytest.mark.parametrize("chamber", [0, 1, 2])
def test_nearly_straight_arms_go_there_and_back(chamber: int, asymmetry_m: float) -> None:
    lengths = np.full(3, 0.2)
    lengths[chamber] += asymmetry_m
    transform = section_transforms(shapes_from_lengths(lengths, OFFSET_M))
    assert np.isfinite(transform).all()
    back = lengths_from_shapes(section_inverse(transform[:3, 3]), OFFSET_M)
    np.testing.assert_allclose(back, lengths, rtol=0.0, atol=1e-15)


def test_the_straight_arm_is_the_identity_moved_along_z() -> None:
    expected = np.eye(4)
    expected[2, 3] = 0.2
    np.testing.assert_array_equal(section_transforms(np.array([0.2, 0.0, 0.0])), expected)


@given(LENGTHS)
def test_a_section_ends_in_a_rigid_motion(lengths: np.ndarray) -> None:
    rotation = section_transforms(shapes_from_lengths(lengths, OFFSET_M))[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_the_inverse_of_a_batch_treats_every_point_alone() -> None:
    points = np.array([[0.0, 0.0, 0.2], [0.05, -0.02, 0.15], [1e-12, 0.0, 0.2]])
    one_by_one = np.array([section_inverse(point) for point in points])
    np.testing.assert_array_equal(section_inverse(points), one_by_one)


@pytest.mark.parametrize("point", [(0.0, 0.0, 0.0), (0.0, 0.0, -0.1), (np.nan, 0.0, 0.2)])
def test_a_point_that_no_arc_ends_at_is_refused(point: tuple[float, float, float]) -> None:
    with pytest.raises(InvalidInput, match="position_m"):
        section_inverse(np.array(point))


@pytest.mark.parametrize("asymmetry_m", [*ASYMMETRIES_M, 1e-3, 3e-2])
def test_the_determinant_of_the_position_follows_the_formula(asymmetry_m: float) -> None:
    lengths = np.array([0.2 + asymmetry_m, 0.2, 0.2 - 0.5 * asymmetry_m])
    step = 1e-5
    columns = []
    for offset in step * np.eye(3):
        ahead = section_transforms(shapes_from_lengths(lengths + offset, OFFSET_M))
        behind = section_transforms(shapes_from_lengths(lengths - offset, OFFSET_M))
        columns.append((ahead[:3, 3] - behind[:3, 3]) / (2.0 * step))
    arc_length, u, v = shapes_from_lengths(lengths, OFFSET_M)
    c = 0.5 * np.sinc(np.hypot(u, v) / (2.0 * np.pi)) ** 2
    formula = arc_length**2 * c**2 * 2.0 / (3.0 * np.sqrt(3.0) * OFFSET_M**2)
    assert abs(np.linalg.det(np.array(columns).T)) == pytest.approx(formula, rel=1e-6)


def test_the_sections_of_a_trunk_follow_each_other() -> None:
    arm = trunk_arm()
    lengths = random_lengths(arm, np.random.default_rng(0))
    product = np.eye(4)
    ends = section_end_transforms(arm, lengths)
    for index, section in enumerate(arm.sections):
        shape = shapes_from_lengths(lengths[index], section.chamber_offset_m)
        product = product @ section_transforms(shape)
        np.testing.assert_allclose(ends[index], product, atol=1e-14)
    np.testing.assert_array_equal(tip_transform(arm, lengths), ends[-1])


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_a_batch_of_configurations_is_each_of_them(arm: Arm) -> None:
    rng = np.random.default_rng(1)
    batch = np.stack([random_lengths(arm, rng) for _ in range(6)]).reshape(2, 3, -1, 3)
    for index in np.ndindex(2, 3):
        np.testing.assert_allclose(
            tip_transform(arm, batch)[index], tip_transform(arm, batch[index]), atol=1e-15
        )


@pytest.mark.parametrize("points", [1, 7])
@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_the_curve_goes_from_the_base_through_the_section_ends_to_the_tip(
    arm: Arm, points: int
) -> None:
    lengths = random_lengths(arm, np.random.default_rng(2))
    frames = curve_transforms(arm, lengths, points)
    assert frames.shape == (arm.n_sections * points + 1, 4, 4)
    np.testing.assert_array_equal(frames[0], np.eye(4))
    ends = section_end_transforms(arm, lengths)
    np.testing.assert_allclose(frames[points::points], ends, atol=1e-14)


def test_the_points_of_a_curve_lie_the_same_arc_length_apart() -> None:
    lengths = np.array([[0.15, 0.2, 0.27]])
    points = curve_transforms(paper_arm(), lengths, 200)[:, :3, 3]
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    np.testing.assert_allclose(steps, steps[0], rtol=1e-9)
    assert steps.sum() == pytest.approx(lengths.mean(), rel=1e-5)

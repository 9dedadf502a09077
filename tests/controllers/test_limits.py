"""The limits: what their rows allow is what clip leaves alone."""

import numpy as np
import pytest
from controllers.limits.length_rate import LengthRateLimit
from hypothesis import given
from hypothesis import strategies as st

from controllers.actuation import length_bounds_m
from controllers.arm import Arm
from controllers.kinematics.constant_curvature import lengths_from_shapes, shapes_from_lengths
from controllers.law import Limits, clamped_step
from controllers.limits.bend import BendLimit
from controllers.limits.length import LengthLimit
from tests.arms import ARMS, paper_arm, random_lengths, trunk_arm

DT_S = 0.005
SEEDS = st.integers(0, 2**32 - 1)


def bend_rad(arm: Arm, lengths: np.ndarray) -> np.ndarray:
    shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))
    return np.hypot(shapes[:, 1], shapes[:, 2])


def anywhere(arm: Arm, seed: int) -> np.ndarray:
    """Lengths from far below to far above their bounds."""
    rng = np.random.default_rng(seed)
    return arm.rest_lengths_m * rng.uniform(0.0, 2.0, (arm.n_sections, 3))


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@pytest.mark.parametrize("limit_of", [LengthLimit, LengthRateLimit, BendLimit])
def test_rows_have_one_shape_and_stay_within_their_pattern(limit_of: type, arm: Arm) -> None:
    limit = limit_of(arm)
    lengths = random_lengths(arm, np.random.default_rng(0))
    rows, lower, upper = limit.rows(lengths, DT_S)
    assert rows.shape == limit.pattern.shape == (lower.size, arm.n_chambers)
    assert lower.shape == upper.shape
    assert (rows[limit.pattern == 0.0] == 0.0).all()
    assert (lower <= 0.0).all()  # standing still is allowed
    assert (upper >= 0.0).all()


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@given(seed=SEEDS)
def test_a_step_within_the_length_rows_is_not_clipped_and_one_beyond_them_is(
    arm: Arm, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    limit = LengthLimit(arm)
    lengths = random_lengths(arm, rng)
    rows, lower, upper = limit.rows(lengths, DT_S)
    inside = lengths + rng.uniform(0.999 * lower, 0.999 * upper).reshape(lengths.shape)
    np.testing.assert_array_equal(limit.clip(inside), inside)
    chamber = rng.integers(arm.n_chambers)
    for bound in (lower, upper):
        step = np.zeros(arm.n_chambers)
        step[chamber] = bound[chamber] + np.copysign(1e-6, bound[chamber] or 1.0)
        beyond = lengths + step.reshape(lengths.shape)
        clipped = limit.clip(beyond)
        assert (clipped != beyond).sum() == 1
        np.testing.assert_allclose(
            (rows @ (clipped - lengths).reshape(-1))[chamber], bound[chamber], atol=1e-15
        )


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_the_rate_rows_are_the_rate_times_the_duration(arm: Arm) -> None:
    _, lower, upper = LengthRateLimit(arm).rows(arm.rest_lengths_m, DT_S)
    expected = [section.length_rate_max_m_s * DT_S for section in arm.sections for _ in range(3)]
    np.testing.assert_allclose(upper, expected)
    np.testing.assert_array_equal(lower, -upper)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@given(seed=SEEDS)
def test_the_bend_row_is_how_fast_the_bend_grows(arm: Arm, seed: int) -> None:
    rng = np.random.default_rng(seed)
    lengths = random_lengths(arm, rng)
    lengths[:, 0] -= 5e-3  # not straight
    rows, _, _ = BendLimit(arm).rows(lengths, DT_S)
    direction = rng.standard_normal(lengths.shape)
    size = 1e-6
    grown = bend_rad(arm, lengths + size * direction) - bend_rad(arm, lengths - size * direction)
    expected = arm.per_section("chamber_offset_m")[:, 0] * grown / (2.0 * size)
    if (bend_rad(arm, lengths) > 0.05).all():
        np.testing.assert_allclose(rows @ direction.reshape(-1), expected, atol=1e-5)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@given(seed=SEEDS)
def test_what_is_left_of_the_bend_is_the_upper_side_of_its_row(arm: Arm, seed: int) -> None:
    limit = BendLimit(arm)
    lengths = random_lengths(arm, np.random.default_rng(seed))
    left = arm.per_section("bend_max_rad")[:, 0] - bend_rad(arm, lengths)
    slack = left * arm.per_section("chamber_offset_m")[:, 0]
    np.testing.assert_allclose(limit.slack_m(lengths), slack, atol=1e-15)
    np.testing.assert_allclose(limit.rows(lengths, DT_S)[2], slack, atol=1e-15)


def test_the_bend_row_of_the_straight_arm_is_finite() -> None:
    for asymmetry in (0.0, 1e-15, 1e-12, 1e-9):
        lengths = trunk_arm().rest_lengths_m + asymmetry * np.eye(3)
        rows, _, upper = BendLimit(trunk_arm()).rows(lengths, DT_S)
        assert np.isfinite(rows).all()
        assert (np.abs(rows).sum(axis=1) > 0.1).all()
        np.testing.assert_allclose(upper, [0.045 * 1.2, 0.038 * 1.5, 0.030 * 1.8], atol=1e-8)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@given(seed=SEEDS)
def test_the_bend_clip_is_exact_and_touches_nothing_but_the_bend(arm: Arm, seed: int) -> None:
    lengths = anywhere(arm, seed)
    clipped = BendLimit(arm).clip(lengths)
    offset = arm.per_section("chamber_offset_m")
    before, after = shapes_from_lengths(lengths, offset), shapes_from_lengths(clipped, offset)
    allowed = np.minimum(bend_rad(arm, lengths), arm.per_section("bend_max_rad")[:, 0])
    np.testing.assert_allclose(bend_rad(arm, clipped), allowed, atol=1e-13)
    np.testing.assert_allclose(after[:, 0], before[:, 0], atol=1e-15)
    angles = [np.arctan2(shape[:, 2], shape[:, 1]) for shape in (before, after)]
    np.testing.assert_allclose(np.cos(angles[0] - angles[1]), 1.0, atol=1e-12)
    within = bend_rad(arm, lengths) <= arm.per_section("bend_max_rad")[:, 0]
    np.testing.assert_array_equal(clipped[within], lengths[within])


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@given(seed=SEEDS)
def test_unbending_keeps_the_length_bounds_that_held_before(arm: Arm, seed: int) -> None:
    limits = Limits(arm)
    low, high = length_bounds_m(arm)
    clipped = limits.clip(anywhere(arm, seed))
    assert (clipped >= low - 1e-15).all()
    assert (clipped <= high + 1e-15).all()
    assert (clipped > arm.per_chamber("length_min_m")).all()
    assert (clipped < arm.per_chamber("length_max_m")).all()
    assert (bend_rad(arm, clipped) <= arm.per_section("bend_max_rad")[:, 0] + 1e-12).all()
    np.testing.assert_allclose(limits.clip(clipped), clipped, atol=1e-15)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@given(seed=SEEDS, size=st.floats(1e-6, 1.0))
def test_no_step_however_large_exceeds_rate_length_or_bend(
    arm: Arm, seed: int, size: float
) -> None:
    rng = np.random.default_rng(seed)
    limits = Limits(arm)
    # From the edge of the bend, where unbending moves chambers on its own.
    shapes = shapes_from_lengths(random_lengths(arm, rng), arm.per_section("chamber_offset_m"))
    shapes[:, 1:] *= 3.0
    start = limits.clip(lengths_from_shapes(shapes, arm.per_section("chamber_offset_m")))
    step = size * rng.standard_normal(arm.n_chambers)
    moved = clamped_step(limits, start, step, DT_S) - start
    allowed = arm.per_chamber("length_rate_max_m_s") * DT_S
    assert (np.abs(moved) <= allowed * (1.0 + 1e-9)).all()
    np.testing.assert_allclose(limits.clip(start + moved), start + moved, atol=1e-14)


def test_a_step_too_large_is_slowed_down_in_its_own_direction() -> None:
    arm = paper_arm()
    start = arm.rest_lengths_m.copy()
    moved = clamped_step(Limits(arm), start, np.array([0.1, -0.05, 0.02]), DT_S) - start
    np.testing.assert_allclose(moved, [[7.5e-4, -3.75e-4, 1.5e-4]], atol=1e-15)


def test_a_step_that_is_allowed_is_taken_as_it_is() -> None:
    arm = paper_arm()
    start = arm.rest_lengths_m.copy()
    step = np.array([1e-4, -2e-4, 5e-5])
    expected = start + step.reshape(1, 3)
    np.testing.assert_array_equal(clamped_step(Limits(arm), start, step, DT_S), expected)

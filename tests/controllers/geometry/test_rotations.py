"""Rotation vector and quaternion by their axioms, up to and at half a turn."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.geometry.rotations import (
    quaternion_from_rotation,
    rotation_from_quaternion,
    symbolic_rotation_vector,
)

SEEDS = st.integers(0, 2**32 - 1)
#: From no turn over the thresholds of the formulas to half a turn.
ANGLES = [0.0, 1e-15, 1e-10, 1e-9, 1e-6, 0.1, 1.5, np.pi - 1e-6, np.pi - 1e-9, np.pi - 1e-12, np.pi]
AXES = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (1, 1, 0), (0, -1, 1), (1, -2, 3)]


_MATRIX = ca.SX.sym("rotation", 3, 3)
_VECTOR = ca.Function("vector", [_MATRIX], [symbolic_rotation_vector(_MATRIX)])


def rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """The laws' own, evaluated."""
    return np.array(_VECTOR(rotation)).reshape(-1)


def unit(axis: tuple[int, int, int]) -> Array:
    return np.array(axis, dtype=float) / np.linalg.norm(axis)


def random_unit_quaternion(seed: int) -> Array:
    quaternion = np.random.default_rng(seed).standard_normal(4)
    return quaternion / np.linalg.norm(quaternion)


@given(SEEDS)
def test_the_matrix_of_a_quaternion_is_a_rotation(seed: int) -> None:
    rotation = rotation_from_quaternion(random_unit_quaternion(seed))
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


@given(SEEDS)
def test_a_quaternion_comes_back_with_w_not_negative(seed: int) -> None:
    quaternion = random_unit_quaternion(seed)
    back = quaternion_from_rotation(rotation_from_quaternion(quaternion))
    expected = quaternion if quaternion[3] >= 0.0 else -quaternion
    np.testing.assert_allclose(back, expected, atol=1e-14)


@given(SEEDS, SEEDS)
def test_the_conversion_respects_composition(first: int, second: int) -> None:
    a, b = random_unit_quaternion(first), random_unit_quaternion(second)
    product = np.array(
        [
            *(a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])),
            a[3] * b[3] - a[:3] @ b[:3],
        ]
    )
    np.testing.assert_allclose(
        rotation_from_quaternion(product),
        rotation_from_quaternion(a) @ rotation_from_quaternion(b),
        atol=1e-14,
    )


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("axis", AXES)
def test_axis_and_angle_come_back_from_the_rotation(
    axis: tuple[int, int, int], angle: float
) -> None:
    vector = angle * unit(axis)
    back = rotation_vector(Rotation.from_rotvec(vector).as_matrix())
    assert np.isfinite(back).all()
    if angle > np.pi - 1e-8 and back @ vector < 0.0:
        back = back * (1.0 - 2.0 * np.pi / np.linalg.norm(back))  # the same turn the other way
    np.testing.assert_allclose(back, vector, atol=2e-7)


@pytest.mark.parametrize("axis", AXES)
def test_half_a_turn_keeps_its_axis_exactly(axis: tuple[int, int, int]) -> None:
    back = rotation_vector(2.0 * np.outer(unit(axis), unit(axis)) - np.eye(3))
    assert np.linalg.norm(back) == pytest.approx(np.pi, abs=1e-14)
    assert abs(back @ unit(axis)) == pytest.approx(np.pi, abs=1e-14)


@given(SEEDS)
def test_the_rotation_vector_turns_into_the_rotation_again(seed: int) -> None:
    rotation = rotation_from_quaternion(random_unit_quaternion(seed))
    vector = rotation_vector(rotation)
    assert np.linalg.norm(vector) <= np.pi
    np.testing.assert_allclose(Rotation.from_rotvec(vector).as_matrix(), rotation, atol=1e-9)


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("axis", AXES)
def test_the_quaternion_of_an_axis_and_an_angle(axis: tuple[int, int, int], angle: float) -> None:
    quaternion = quaternion_from_rotation(Rotation.from_rotvec(angle * unit(axis)).as_matrix())
    assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-14)
    assert quaternion[3] >= 0.0
    expected = np.array([*np.sin(angle / 2) * unit(axis), np.cos(angle / 2)])
    assert abs(quaternion @ expected) == pytest.approx(1.0, abs=1e-14)

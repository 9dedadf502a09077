"""The paper's equations against each other, against numbers and against the form that runs."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import section_transforms
from pneuarm.controllers.kinematics.serial_chain import (
    CHAIN,
    VARIABLES,
    chain_frames,
    chain_transform,
    paper_transform,
    propagated_jacobian,
    serial_jacobian,
    velocity_jacobian,
)

PHI = st.floats(-np.pi, np.pi)
THETA = st.floats(0.01, 3.5)
RADIUS = st.floats(0.02, 5.0)


def about_z(angle_rad: float) -> np.ndarray:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def shape(phi: float, theta: float, radius: float) -> np.ndarray:
    return np.array([radius * theta, theta * np.cos(phi), theta * np.sin(phi)])


def numerical_twist(transform: object, parameters: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """Columns (v, omega) of the derivative of ``transform(*parameters)`` by central differences."""
    columns = []
    here = transform(*parameters)  # type: ignore[operator]
    for offset in step * np.eye(parameters.size):
        ahead = transform(*(parameters + offset))  # type: ignore[operator]
        behind = transform(*(parameters - offset))  # type: ignore[operator]
        rate = (ahead - behind) / (2.0 * step)
        spin = rate[:3, :3] @ here[:3, :3].T
        columns.append([*rate[:3, 3], spin[2, 1], spin[0, 2], spin[1, 0]])
    return np.array(columns).T


@given(PHI, THETA, RADIUS)
def test_the_singularity_free_position_is_the_translation_of_eq_1(
    phi: float, theta: float, radius: float
) -> None:
    ours = section_transforms(shape(phi, theta, radius))
    np.testing.assert_allclose(
        ours[:3, 3], paper_transform(phi, theta, radius)[:3, 3], rtol=0.0, atol=1e-14 * (1 + radius)
    )


@given(PHI, THETA, RADIUS)
def test_the_twist_free_frame_is_the_frame_of_eq_1_turned_back_by_phi(
    phi: float, theta: float, radius: float
) -> None:
    expected = paper_transform(phi, theta, radius)[:3, :3] @ about_z(-phi)
    np.testing.assert_allclose(
        section_transforms(shape(phi, theta, radius))[:3, :3], expected, atol=1e-14
    )


@given(PHI, THETA, RADIUS)
def test_eq_2_is_eq_3(phi: float, theta: float, radius: float) -> None:
    np.testing.assert_allclose(
        velocity_jacobian(phi, theta, radius), serial_jacobian(phi, theta, radius), atol=1e-14 * 9
    )


@given(PHI, THETA, RADIUS)
def test_eq_2_is_the_derivative_of_eq_1(phi: float, theta: float, radius: float) -> None:
    numerical = numerical_twist(paper_transform, np.array([phi, theta, radius]))
    np.testing.assert_allclose(velocity_jacobian(phi, theta, radius), numerical, atol=1e-8)


@given(PHI, THETA, RADIUS)
def test_the_singularity_free_form_moves_like_eq_2_up_to_the_turn_about_its_own_axis(
    phi: float, theta: float, radius: float
) -> None:
    def ours(phi: float, theta: float, radius: float) -> np.ndarray:
        return section_transforms(shape(phi, theta, radius))

    numerical = numerical_twist(ours, np.array([phi, theta, radius]))
    paper = velocity_jacobian(phi, theta, radius)
    np.testing.assert_allclose(numerical[:3], paper[:3], atol=1e-8)
    numerical[3:, 0] += ours(phi, theta, radius)[:3, 2]  # phi_dot z_tip
    np.testing.assert_allclose(numerical[3:], paper[3:], atol=1e-8)


@given(PHI, THETA, RADIUS)
def test_eq_1_is_a_rigid_motion(phi: float, theta: float, radius: float) -> None:
    transform = paper_transform(phi, theta, radius)
    rotation = transform[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    np.testing.assert_array_equal(transform[3], [0.0, 0.0, 0.0, 1.0])


@given(PHI, THETA, RADIUS)
def test_the_product_of_the_four_joints_is_eq_1(phi: float, theta: float, radius: float) -> None:
    np.testing.assert_allclose(
        chain_transform(phi, theta, radius),
        paper_transform(phi, theta, radius),
        rtol=0.0,
        atol=1e-15 * (4 + 4 * radius),
    )


@given(PHI, THETA, RADIUS)
def test_velocities_propagated_along_the_chain_are_eq_2(
    phi: float, theta: float, radius: float
) -> None:
    np.testing.assert_allclose(
        propagated_jacobian(phi, theta, radius),
        velocity_jacobian(phi, theta, radius),
        rtol=0.0,
        atol=1e-14 * 9,
    )


@given(PHI, THETA, RADIUS)
def test_the_chain_stands_where_the_paper_draws_it(phi: float, theta: float, radius: float) -> None:
    frames = chain_frames(phi, theta, radius)
    c, s = np.cos(phi), np.sin(phi)
    tip = paper_transform(phi, theta, radius)
    axes = [[0.0, 0.0, 1.0], [c, s, 0.0], [-s, c, 0.0], -tip[:3, 0]]
    centre = radius * np.array([c, s, 0.0])
    origins = [np.zeros(3), np.zeros(3), centre, centre, tip[:3, 3]]
    np.testing.assert_allclose(frames.axes, axes, atol=1e-15)
    np.testing.assert_allclose(frames.origins_m, origins, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(frames.origins_m[4] - centre), radius, rtol=1e-12)


def test_the_coupling_of_the_chain_is_mutual_and_of_the_prismatic_joints() -> None:
    coupled = {
        number: joint.coupled_with for number, joint in enumerate(CHAIN, 1) if joint.coupled_with
    }
    assert coupled == {2: 4, 4: 2}
    for number, other in coupled.items():
        assert CHAIN[number - 1].variable == CHAIN[other - 1].variable
        assert CHAIN[number - 1].kind == "prismatic"
    assert {joint.variable for joint in CHAIN} == set(VARIABLES)


@pytest.mark.parametrize(
    "function",
    [chain_transform, paper_transform, velocity_jacobian, propagated_jacobian, serial_jacobian],
)
def test_a_batch_of_arcs_is_each_of_them(function: Callable[..., np.ndarray]) -> None:
    rng = np.random.default_rng(0)
    phi, theta = rng.uniform(-3.0, 3.0, (4, 1)), rng.uniform(0.1, 3.0, 5)
    together = function(phi, theta, 0.2)
    assert together.shape[:2] == (4, 5)
    for i, j in np.ndindex(4, 5):
        np.testing.assert_allclose(together[i, j], function(phi[i, 0], theta[j], 0.2), atol=1e-15)


@pytest.mark.parametrize("function", [paper_transform, velocity_jacobian, serial_jacobian])
@pytest.mark.parametrize("radius", [0.0, -0.1, np.nan])
def test_a_radius_that_is_not_above_zero_is_refused_with_its_value(
    function: object, radius: float
) -> None:
    with pytest.raises(InvalidInput, match=r"radius_m = .*above 0"):
        function(0.1, 0.2, radius)  # type: ignore[operator]


def test_an_angle_that_is_not_finite_is_refused() -> None:
    with pytest.raises(InvalidInput, match="theta_rad = inf"):
        paper_transform(0.1, np.inf, 0.2)

"""Maps between (phi, theta, r), (L, u, v) and lengths, and the two tip frames."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import section_transforms
from pneuarm.controllers.kinematics.parameters import (
    arc_rates,
    arcs_from_lengths,
    arcs_from_shapes,
    from_frame,
    in_frame,
    lengths_from_arcs,
    shapes_from_arcs,
)
from pneuarm.controllers.kinematics.serial_chain import paper_transform

PHI = st.floats(-3.14, 3.14)
THETA = st.floats(1e-6, 6.0)
LENGTH = st.floats(0.05, 0.5)
OFFSET_M = 0.038


def arcs(phi: float, theta: float, length: float) -> np.ndarray:
    return np.array([phi, theta, length / theta])


@given(PHI, THETA, LENGTH)
def test_arcs_come_back_from_shapes_and_from_lengths(
    phi: float, theta: float, length: float
) -> None:
    given_arcs = arcs(phi, theta, length)
    shape = shapes_from_arcs(given_arcs)
    assert shape[0] == pytest.approx(length, rel=1e-14)
    np.testing.assert_allclose(arcs_from_shapes(shape), given_arcs, rtol=1e-13, atol=1e-15)
    lengths = lengths_from_arcs(given_arcs, OFFSET_M)
    assert lengths.mean() == pytest.approx(length, rel=1e-13)
    # Lengths of 1e-17 m make angles of 1e-15 rad: what the lengths hold comes back.
    np.testing.assert_allclose(arcs_from_lengths(lengths, OFFSET_M)[1], theta, atol=1e-13)


def test_the_straight_arm_has_an_infinite_radius_and_there_is_no_way_back() -> None:
    straight = arcs_from_shapes(np.array([0.2, 0.0, 0.0]))
    np.testing.assert_array_equal(straight, [0.0, 0.0, np.inf])
    with pytest.raises(InvalidInput, match=r"arcs \(r, m\) = inf"):
        shapes_from_arcs(straight)


@given(PHI, THETA, LENGTH)
def test_the_paper_frame_is_that_of_eq_1_and_turns_back(
    phi: float, theta: float, length: float
) -> None:
    parameters = arcs(phi, theta, length)
    shape = shapes_from_arcs(parameters)
    free = section_transforms(shape)
    paper = in_frame(free, shape, "paper")
    np.testing.assert_allclose(paper, paper_transform(*parameters), atol=1e-9)
    np.testing.assert_allclose(paper[:3, :3], paper_transform(*parameters)[:3, :3], atol=1e-14)
    np.testing.assert_allclose(from_frame(paper, shape, "paper"), free, atol=1e-15)


def test_the_twist_free_frame_is_the_one_that_comes_in() -> None:
    shape = np.array([0.2, 0.3, -0.4])
    free = section_transforms(shape)
    np.testing.assert_array_equal(in_frame(free, shape, "twist_free"), free)
    assert np.abs(in_frame(free, shape, "paper") - free).max() > 0.1


def test_one_transform_for_many_shapes_makes_a_batch() -> None:
    shapes = np.random.default_rng(0).uniform(-1.0, 1.0, (5, 3))
    assert in_frame(np.eye(4), shapes, "paper").shape == (5, 4, 4)


@given(PHI, st.floats(0.05, 6.0), LENGTH)
def test_the_rates_are_the_derivative_of_the_map(phi: float, theta: float, length: float) -> None:
    at, step = arcs(phi, theta, length), 1e-6
    numerical = [
        (shapes_from_arcs(at + offset) - shapes_from_arcs(at - offset)) / (2.0 * step)
        for offset in step * np.eye(3)
    ]
    np.testing.assert_allclose(arc_rates(shapes_from_arcs(at)), np.array(numerical).T, atol=1e-8)


def test_the_straight_arm_has_no_rates_of_arcs() -> None:
    shapes = np.array([[0.2, 0.1, 0.0], [0.2, 0.0, 0.0]])
    with pytest.raises(InvalidInput, match=r"theta_rad\[1\] = 0.0"):
        arc_rates(shapes)

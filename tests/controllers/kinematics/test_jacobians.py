"""The singularity-free Jacobian: by numbers, by the compiled one, anywhere along the arm."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.compiled import CompiledKinematics
from pneuarm.controllers.kinematics.constant_curvature import (
    curve_transforms,
    lengths_from_shapes,
    shapes_from_lengths,
    tip_transform,
)
from pneuarm.controllers.kinematics.jacobians import (
    jacobians,
    section_jacobians,
    shape_rates,
    station_transforms,
    stations_at,
)
from pneuarm.controllers.kinematics.parameters import arc_rates, shapes_from_arcs
from pneuarm.controllers.kinematics.serial_chain import velocity_jacobian
from tools.rig.arms import ARMS, random_lengths, trunk_arm
from tools.validation.figures_kinematics import numerical_jacobian

STATIONS = (0.0, 0.3, 1.0, 1.5, 2.0, 2.999, 3.0)


def configurations(arm: Arm, number: int = 4) -> np.ndarray:
    """Straight, nearly straight and random ones (number + 2, n_sections, 3)."""
    rng = np.random.default_rng(5)
    rest = arm.rest_lengths_m
    nearly = rest + 1e-9 * rng.standard_normal(rest.shape)
    return np.stack([rest, nearly, *(random_lengths(arm, rng, 0.95) for _ in range(number))])


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_the_tip_jacobian_is_the_compiled_one(arm: Arm) -> None:
    kinematics = CompiledKinematics(arm)
    lengths = configurations(arm)
    for one, jacobian in zip(lengths, jacobians(arm, lengths), strict=True):
        np.testing.assert_allclose(jacobian, kinematics.evaluate(one).jacobian, atol=2e-13)


@pytest.mark.parametrize("station", STATIONS)
@pytest.mark.parametrize("over", ["lengths", "shapes"])
def test_any_point_moves_as_numbers_say(station: float, over: str) -> None:
    arm = trunk_arm()
    offset = arm.per_section("chamber_offset_m")
    lengths = configurations(arm)
    columns = lengths if over == "lengths" else shapes_from_lengths(lengths, offset)

    def transforms(at: np.ndarray) -> np.ndarray:
        at = at.reshape(-1, 3, 3)
        return station_transforms(
            arm, at if over == "lengths" else lengths_from_shapes(at, offset), station
        )

    flat = columns.reshape(len(columns), -1)
    numerical = numerical_jacobian(transforms, flat, np.full_like(flat, 5e-4))
    ours = jacobians(arm, lengths, station, over=over)  # type: ignore[arg-type]
    np.testing.assert_allclose(ours, numerical, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_the_body_jacobian_is_the_base_jacobian_turned(arm: Arm) -> None:
    lengths = configurations(arm)
    stations = np.linspace(0.1, arm.n_sections, len(lengths))
    turn = station_transforms(arm, lengths, stations)[:, :3, :3]
    base = jacobians(arm, lengths, stations)
    body = jacobians(arm, lengths, stations, seen_from="body")
    np.testing.assert_allclose(turn @ body[:, :3], base[:, :3], atol=1e-13)
    np.testing.assert_allclose(turn @ body[:, 3:], base[:, 3:], atol=1e-12)
    assert np.abs(body - base).max() > 0.01


def test_a_point_does_not_feel_the_sections_beyond_it() -> None:
    arm = trunk_arm()
    lengths = configurations(arm)
    jacobian = jacobians(arm, lengths, 1.25)
    np.testing.assert_array_equal(jacobian[..., 6:], 0.0)
    assert (np.abs(jacobian[..., :6]).max(axis=-2) > 0.0).all()


@given(st.floats(-np.pi, np.pi), st.floats(0.01, 6.0), st.floats(0.05, 0.5))
def test_over_the_papers_parameters_it_is_eq_2(phi: float, theta: float, length: float) -> None:
    arcs = np.array([phi, theta, length / theta])
    shape = shapes_from_arcs(arcs)
    ours = section_jacobians(shape) @ arc_rates(shape)
    # The paper's frame turns by phi_dot about its own z axis more than the twist-free one.
    ours[3:, 0] += [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    np.testing.assert_allclose(ours, velocity_jacobian(*arcs), rtol=0.0, atol=1e-12)


def test_batches_of_configurations_and_of_stations_broadcast() -> None:
    arm = trunk_arm()
    lengths = configurations(arm)
    stations = np.array(STATIONS)
    together = jacobians(arm, lengths[:, None], stations)
    assert together.shape == (len(lengths), len(stations), 6, 9)
    for i, j in product(range(len(lengths)), range(len(stations))):
        np.testing.assert_allclose(
            together[i, j], jacobians(arm, lengths[i], stations[j]), atol=1e-14
        )


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_stations_run_along_the_curve(arm: Arm) -> None:
    lengths = configurations(arm)[-1]
    stations = np.linspace(0.0, arm.n_sections, 4 * arm.n_sections + 1)
    np.testing.assert_allclose(
        station_transforms(arm, lengths, stations), curve_transforms(arm, lengths, 4), atol=1e-14
    )
    np.testing.assert_allclose(
        station_transforms(arm, lengths), tip_transform(arm, lengths), atol=1e-14
    )


def test_an_arc_length_names_its_station() -> None:
    arm = trunk_arm()
    lengths = configurations(arm)
    sections = lengths.mean(axis=-1)
    middle_of_second = sections[:, 0] + 0.5 * sections[:, 1]
    np.testing.assert_allclose(stations_at(arm, lengths, middle_of_second), 1.5, atol=1e-14)
    np.testing.assert_allclose(stations_at(arm, lengths, sections.sum(axis=-1)), 3.0, atol=1e-14)
    assert (stations_at(arm, lengths, 0.0) == 0.0).all()
    with pytest.raises(InvalidInput, match=r"arc_length_m\[0\] = 2.0: .*between base"):
        stations_at(arm, lengths, 2.0)


def test_the_rates_of_the_shape_are_the_map_itself() -> None:
    lengths = np.array([0.13, 0.22, 0.28])
    for offset in (0.03, np.array([0.03, 0.05])):
        shapes = (shape_rates(offset) @ lengths).reshape(-1, 3)
        for d, shape in zip(np.atleast_1d(offset), shapes, strict=True):
            np.testing.assert_allclose(shape, shapes_from_lengths(lengths, d), atol=1e-14)

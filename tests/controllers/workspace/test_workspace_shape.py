"""Mesh, volume, extents and samples of one section's workspace, each against another way."""

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import (
    lengths_from_shapes,
    section_inverse,
    shapes_from_lengths,
    tip_transform,
)
from pneuarm.controllers.workspace.mesh import Mesh, hull_mesh, section_mesh
from pneuarm.controllers.workspace.region import SectionRegion
from pneuarm.controllers.workspace.sampling import samples_at, share_of, uniform_samples
from pneuarm.controllers.workspace.volume import (
    extents_error_m,
    extents_m,
    integrated_volume,
    least_radius_over_offset,
    meshed_volume,
)
from tests.controllers.workspace.test_workspace import ONE_SECTION, every_section, tip
from tools.rig.arms import paper_arm, random_lengths, trunk_arm


def edges_seen(mesh: Mesh) -> np.ndarray:
    """How many triangles each undirected edge belongs to."""
    pairs = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return np.unique(pairs, axis=0, return_counts=True)[1]


@every_section
@pytest.mark.parametrize("cells", [2, 7, 24])
def test_the_mesh_is_a_closed_surface_without_handles(name: str, cells: int) -> None:
    mesh = section_mesh(SectionRegion(ONE_SECTION[name]), cells)
    counts = edges_seen(mesh)
    assert (counts == 2).all()
    assert mesh.is_watertight
    assert len(mesh.vertices_m) - len(counts) + len(mesh.triangles) == 2  # Euler: a sphere
    assert len(np.unique(mesh.triangles)) == len(mesh.vertices_m)
    assert len(np.unique(mesh.vertices_m.round(10), axis=0)) == len(mesh.vertices_m)


def test_a_mesh_with_a_hole_or_a_turned_triangle_is_not_watertight() -> None:
    mesh = section_mesh(SectionRegion(paper_arm()), 4)
    assert not Mesh(mesh.vertices_m, mesh.triangles[1:]).is_watertight
    turned = mesh.triangles.copy()
    turned[5] = turned[5, ::-1]
    assert not Mesh(mesh.vertices_m, turned).is_watertight


@every_section
def test_every_vertex_lies_on_the_boundary(name: str) -> None:
    region = SectionRegion(ONE_SECTION[name])
    vertices = section_mesh(region, 8).vertices_m
    assert region.contains(vertices).all()
    names = region.limits
    for vertex in vertices:
        length = np.array([lengths_at(region, vertex)])
        assert names.within(length, 1e-7)  # some limit binds
        assert not names.within(length, -1e-9)  # and none is exceeded


def lengths_at(region: SectionRegion, position: np.ndarray) -> np.ndarray:
    return lengths_from_shapes(section_inverse(position), region.offset_m)


@every_section
def test_three_ways_to_the_volume_agree_within_their_errors(name: str) -> None:
    region = SectionRegion(ONE_SECTION[name])
    integrated, meshed = integrated_volume(region), meshed_volume(region)
    _, counted = uniform_samples(region, 20_000, np.random.default_rng(0))
    assert integrated.error < 1e-9 * integrated.value
    assert meshed.error < 1e-3 * meshed.value
    assert abs(meshed.value - integrated.value) <= meshed.error + integrated.error
    assert abs(counted.value - integrated.value) <= counted.error
    assert counted.error < 0.1 * counted.value


@every_section
def test_the_mesh_converges_with_the_square_of_its_width(name: str) -> None:
    region = SectionRegion(ONE_SECTION[name])
    exact = integrated_volume(region).value
    errors = [exact - section_mesh(region, cells).volume_m3 for cells in (12, 24, 48)]
    assert 3.3 < errors[0] / errors[1] < 4.7
    assert 3.3 < errors[1] / errors[2] < 4.7


def test_the_figures_of_the_paper_arm_do_not_drift() -> None:
    region = SectionRegion(paper_arm())  # bend limit 2.5 rad in the tests
    assert integrated_volume(region).value == pytest.approx(1.3282763e-2, rel=1e-6)
    assert extents_m(region)[1, 2] == pytest.approx(0.299999, abs=1e-8)
    assert least_radius_over_offset(region) > 1.0


@every_section
def test_the_extents_hold_all_members_and_the_mesh_comes_near_them(name: str) -> None:
    arm = ONE_SECTION[name]
    region, rng = SectionRegion(arm), np.random.default_rng(4)
    low, high = extents_m(region)
    tips = tip(arm, np.array([random_lengths(arm, rng) for _ in range(2000)]))
    assert (tips >= low - 1e-9).all()
    assert (tips <= high + 1e-9).all()
    assert 0.0 < extents_error_m(region) < 1e-4


def test_the_least_radius_is_the_smallest_of_many_arcs() -> None:
    arm = paper_arm()
    region, rng = SectionRegion(arm), np.random.default_rng(5)
    least = least_radius_over_offset(region)
    lengths = np.array([random_lengths(arm, rng)[0] for _ in range(3000)])
    shapes = shapes_from_lengths(lengths, region.offset_m)
    ratio = shapes[:, 0] / np.hypot(shapes[:, 1], shapes[:, 2]) / region.offset_m
    assert least <= ratio.min() < 1.3 * least


def test_manipulability_is_the_determinant_in_closed_form() -> None:
    arm = paper_arm()
    samples, _ = uniform_samples(SectionRegion(arm), 500, np.random.default_rng(6))
    d = arm.sections[0].chamber_offset_m
    shapes = shapes_from_lengths(samples.lengths_m[:, 0], d)
    theta = np.hypot(shapes[:, 1], shapes[:, 2])
    c = 0.5 * np.sinc(theta / (2.0 * np.pi)) ** 2
    expected = shapes[:, 0] ** 2 * c**2 * 2.0 / (3.0 * np.sqrt(3.0) * d**2)
    np.testing.assert_allclose(samples.manipulability, expected, rtol=1e-9)


def test_the_condition_is_that_of_a_numerical_derivative() -> None:
    arm, step = paper_arm(), 1e-6
    samples, _ = uniform_samples(SectionRegion(arm), 60, np.random.default_rng(8))
    for lengths, condition in zip(samples.lengths_m, samples.condition, strict=True):
        moved = lengths + step * np.concatenate([np.eye(3), -np.eye(3)])[:, None]
        tips = tip(arm, moved)
        jacobian = (tips[:3] - tips[3:]).T / (2.0 * step)
        assert np.linalg.cond(jacobian) == pytest.approx(condition, rel=1e-6)


def test_the_condition_of_the_straight_arm_is_that_of_its_two_stiffnesses() -> None:
    # Straight: dz/dl has the norm 1/sqrt(3), dx/dl is L/2 du/dl with the norm L/(2 d) sqrt(2/3).
    arm = paper_arm()
    samples = samples_at(arm, arm.rest_lengths_m[None])
    across = 0.2 / (2.0 * 0.038) * np.sqrt(2.0 / 3.0)
    assert samples.condition[0] == pytest.approx(across * np.sqrt(3.0), rel=1e-9)
    assert samples.manipulability[0] == pytest.approx(across**2 / np.sqrt(3.0), rel=1e-9)


@pytest.mark.parametrize("arm", [paper_arm(), trunk_arm()], ids=["paper", "trunk"])
def test_samples_belong_together(arm: Arm) -> None:
    rng = np.random.default_rng(7)
    lengths = np.array([random_lengths(arm, rng) for _ in range(20)])
    samples = samples_at(arm, lengths)
    np.testing.assert_allclose(
        samples.positions_m, tip_transform(arm, lengths)[:, :3, 3], atol=1e-12
    )
    assert samples.pressures_pa.shape == samples.lengths_m.shape
    some = samples.chosen(np.array([3, 1]))
    np.testing.assert_array_equal(some.positions_m, samples.positions_m[[3, 1]])


@pytest.mark.parametrize(("hits", "count"), [(0, 50), (50, 50), (20, 50)])
def test_a_counted_volume_always_has_an_error(hits: int, count: int) -> None:
    figure = share_of(2.0, hits, count)
    assert figure.value == pytest.approx(2.0 * hits / count)
    assert 0.0 < figure.error < 2.0


def test_a_hull_looks_outward_and_encloses_its_points() -> None:
    corners = np.array(np.meshgrid([0, 1], [0, 2], [0, 3])).reshape(3, -1).T.astype(float)
    mesh = hull_mesh(np.concatenate([corners, [[0.5, 0.5, 0.5]]]))
    assert mesh.outer_hull
    assert mesh.is_watertight
    assert len(mesh.vertices_m) == 8
    assert mesh.volume_m3 == pytest.approx(6.0)


def test_counts_that_mean_nothing_are_refused() -> None:
    region = SectionRegion(paper_arm())
    with pytest.raises(InvalidInput, match="cells = 1: at least 2"):
        section_mesh(region, 1)
    with pytest.raises(InvalidInput, match="count = 0: at least 1"):
        uniform_samples(region, 0, np.random.default_rng(0))

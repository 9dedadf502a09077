"""Reach of several sections by search, held against the exact answers of one section."""

from functools import cache

import numpy as np
import pytest

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from pneuarm.controllers.limits.limits import Limits
from pneuarm.controllers.workspace.hull import SearchedShape, inside_convex, uniform_inside
from pneuarm.controllers.workspace.mesh import hull_mesh
from pneuarm.controllers.workspace.region import SectionRegion
from pneuarm.controllers.workspace.search import (
    SEARCH_TOLERANCE_M,
    SearchedRegion,
    random_configurations,
)
from pneuarm.controllers.workspace.summary import summarise
from pneuarm.controllers.workspace.support import Support, wedge_directions
from pneuarm.controllers.workspace.volume import extents_m, integrated_volume
from pneuarm.controllers.workspace.workspace import Workspace
from tools.rig.arms import ARMS, paper_arm, random_lengths, table1_arm, trunk_arm

one_section = pytest.mark.parametrize("name", ["paper", "table1"])
AXES = np.concatenate([-np.eye(3), np.eye(3)])


@cache
def searched(name: str) -> SearchedRegion:
    return SearchedRegion(ARMS[name])


@cache
def support(name: str) -> Support:
    return Support(ARMS[name])


def tip(arm: Arm, lengths: np.ndarray) -> np.ndarray:
    return tip_transform(arm, lengths)[..., :3, 3]


@one_section
def test_the_search_and_the_exact_test_agree_on_membership(name: str) -> None:
    low, high = extents_m(SectionRegion(ARMS[name]))
    points = np.random.default_rng(0).uniform(low, high, (60, 3))
    exact = Workspace(ARMS[name]).contains(points)
    assert 5 < exact.sum() < 55
    np.testing.assert_array_equal(searched(name).contains(points), exact)


@one_section
def test_the_search_finds_the_exact_nearest_point(name: str) -> None:
    points = np.random.default_rng(1).uniform(-0.3, 0.4, (15, 3))
    workspace = Workspace(ARMS[name])
    for point in points[~workspace.contains(points)]:
        exact, found = workspace.is_reachable(point), searched(name).nearest(point)
        assert exact.distance_m - 1e-9 <= found.distance_m < exact.distance_m + 1e-4


def test_tips_of_three_sections_are_reached_within_the_tolerance() -> None:
    arm, rng = trunk_arm(), np.random.default_rng(2)
    for position in tip(arm, np.array([random_lengths(arm, rng) for _ in range(40)])):
        answer = searched("trunk").nearest(position)
        assert answer.reachable
        assert answer.limits == 0
        np.testing.assert_array_equal(answer.nearest_m, position)
        lengths, distance = searched("trunk").search(position)
        assert distance <= SEARCH_TOLERANCE_M
        assert np.linalg.norm(tip(arm, lengths) - position) == pytest.approx(distance, abs=1e-12)
        np.testing.assert_allclose(Limits(arm).clip(lengths), lengths, atol=1e-12)


def test_beyond_the_boundary_the_nearest_point_is_the_one_that_reaches_furthest() -> None:
    # Along the normal of a convex body nothing is nearer than its own foot.
    directions = wedge_directions(12)
    _, tips, errors = support("trunk").furthest(directions)
    excess = []
    for foot, normal in zip(tips, directions, strict=True):
        answer = searched("trunk").nearest(foot + 0.1 * normal)
        assert not answer.reachable
        assert answer.limits != 0
        excess.append(answer.distance_m - 0.1)
        offset = foot + 0.1 * normal - answer.nearest_m
        assert np.linalg.norm(offset) == pytest.approx(answer.distance_m, abs=1e-9)
    assert min(excess) >= -errors.max() - 1e-6
    assert np.median(excess) < 1e-3
    assert max(excess) < 2e-2  # a search may rest in a fold of the boundary


@one_section
def test_the_support_function_is_that_of_the_exact_boundary(name: str) -> None:
    _, tips, errors = support(name).furthest(AXES)
    low, high = extents_m(SectionRegion(ARMS[name]))
    np.testing.assert_allclose((tips * AXES).sum(axis=1), [*-low, *high], atol=1e-7)
    assert errors.max() < 1e-12


def test_the_support_function_exceeds_every_configuration_and_is_attained() -> None:
    arm, rng = trunk_arm(), np.random.default_rng(3)
    directions = rng.standard_normal((30, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    lengths, tips, errors = support("trunk").furthest(directions)
    np.testing.assert_allclose(tips, tip(arm, lengths), atol=1e-12)
    assert max(np.abs(Limits(arm).clip(row) - row).max() for row in lengths) < 1e-12
    assert errors.max() < 2e-3
    others = tip(arm, random_configurations(arm, 20_000, rng))
    reach = np.einsum("ni,ni->n", tips, directions)
    assert (reach + errors >= (others @ directions.T).max(axis=0)).all()
    straight_up = support("trunk").furthest(np.array([[0.0, 0.0, 1.0]]))[1]
    assert straight_up[0, 2] == pytest.approx(arm.max_length_m, abs=1e-5)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_random_configurations_keep_all_limits_and_come_near_each(arm: Arm) -> None:
    lengths = random_configurations(arm, 2000, np.random.default_rng(4))
    low, high = length_bounds_m(arm)
    assert max(np.abs(Limits(arm).clip(row) - row).max() for row in lengths) < 1e-12
    span = high - low
    assert ((lengths.min(axis=0) - low) / span < 0.05).all()
    assert ((high - lengths.max(axis=0)) / span < 0.05).all()


@one_section
def test_a_volume_by_search_agrees_with_the_exact_one(name: str) -> None:
    shape = SearchedShape(ARMS[name], searched(name))
    hull = shape.hull(100)
    exact = integrated_volume(SectionRegion(ARMS[name])).value
    assert hull.outer_hull
    assert hull.is_watertight
    assert hull.volume_m3 > exact  # the convex hull holds more than the workspace
    figure = shape.volume(hull, 200, np.random.default_rng(5))
    assert abs(figure.value - exact) <= figure.error
    assert figure.error < 0.4 * exact


def test_points_uniform_in_a_hull_are_inside_and_share_its_centre() -> None:
    corners = np.array(np.meshgrid([-1, 1], [-1, 1], [0, 2])).reshape(3, -1).T.astype(float)
    tetrahedron = hull_mesh(corners[[0, 3, 5, 6]])
    points = uniform_inside(tetrahedron, 4000, np.random.default_rng(6))
    assert points.shape == (4000, 3)
    assert inside_convex(tetrahedron, points, 1e-12).all()
    np.testing.assert_allclose(points.mean(0), tetrahedron.vertices_m.mean(0), atol=0.05)
    outside = tetrahedron.vertices_m * 1.1
    assert not inside_convex(tetrahedron, outside, 0.0).all()


@pytest.mark.parametrize("arm", [table1_arm(), trunk_arm()], ids=["table1", "trunk"])
def test_a_summary_holds_together(arm: Arm) -> None:
    summary = summarise(arm, 300, seed=1)
    assert summary.exact == (arm.n_sections == 1)
    assert summary.mesh.outer_hull != summary.exact
    assert summary.mesh.is_watertight
    low, high = summary.extents_m
    margin = summary.extents_error_m + 1e-3
    assert (summary.mesh.vertices_m >= low - margin).all()
    assert (summary.mesh.vertices_m <= high + margin).all()
    assert (summary.samples.positions_m >= low - margin).all()
    assert summary.furthest_from_base_m <= arm.max_length_m
    assert summary.furthest_from_axis_m >= high[0] - 1e-6
    assert summary.least_radius.shape == (arm.n_sections,)
    assert summary.volume.value <= summary.checks[-1].value + summary.checks[-1].error + (
        summary.volume.error
    )


def test_too_few_samples_are_refused() -> None:
    with pytest.raises(InvalidInput, match="samples = 9: at least 10"):
        summarise(paper_arm(), 9)

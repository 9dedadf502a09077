"""Reach of one section: membership against the limits, the nearest point against brute force."""

import timeit
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import (
    lengths_from_shapes,
    section_transforms,
    shapes_from_lengths,
)
from pneuarm.controllers.limits.bend import BendLimit
from pneuarm.controllers.limits.length import LengthLimit
from pneuarm.controllers.limits.limit import AT_BOUND_M
from pneuarm.controllers.limits.pressure import PressureLimit
from pneuarm.controllers.workspace.reachability import LimitNames
from pneuarm.controllers.workspace.region import WEDGE_RAD, SectionRegion, Sheet, folded, unfolded
from pneuarm.controllers.workspace.workspace import SolvedRegion, Workspace
from tools.rig.arms import PAPER_SECTION, paper_arm, random_lengths, table1_arm, trunk_arm

#: In the third the box of the lengths ends before the bend in some directions, and after in others.
ONE_SECTION = {
    "paper": paper_arm(),
    "table1": table1_arm(),
    "mixed": Arm("mixed", (replace(PAPER_SECTION, bend_max_rad=3.2),)),
}
WORKSPACES = {name: Workspace(arm) for name, arm in ONE_SECTION.items()}
SEEDS = st.integers(0, 2**32 - 1)

every_section = pytest.mark.parametrize("name", ONE_SECTION)


def tip(arm: Arm, lengths: np.ndarray) -> np.ndarray:
    """Tip of one section with any lengths ``(..., 1, 3)``, outside the limits too."""
    shapes = shapes_from_lengths(lengths[..., 0, :], arm.sections[0].chamber_offset_m)
    return section_transforms(shapes)[..., :3, 3]


def boundary_cloud(region: SectionRegion, n: int) -> np.ndarray:
    """Points all over the boundary, by turning and mirroring the wedge's."""
    nodes = np.linspace(0.0, 1.0, n)
    across, along = np.meshgrid(WEDGE_RAD * nodes, nodes)
    wedge = np.concatenate([region.points(np.array(s), across, along) for s in Sheet])
    flat = wedge.reshape(-1, 3).T
    turns = [(2.0 * WEDGE_RAD * k, side) for k in range(3) for side in (1.0, -1.0)]
    return np.concatenate([unfolded(flat, turn, side).T for turn, side in turns])


@every_section
@given(seed=SEEDS)
def test_tips_of_lengths_within_the_limits_are_members(name: str, seed: int) -> None:
    arm = ONE_SECTION[name]
    lengths = random_lengths(arm, np.random.default_rng(seed))
    answer = WORKSPACES[name].is_reachable(tip(arm, lengths))
    assert answer.reachable
    assert answer.limits == 0
    assert answer.distance_m == 0.0
    np.testing.assert_array_equal(answer.nearest_m, tip(arm, lengths))


@every_section
@settings(max_examples=40)
@given(seed=SEEDS, beyond=st.floats(1e-7, 0.05))
def test_lengths_beyond_a_limit_give_no_member_and_their_limit_is_named(
    name: str, seed: int, beyond: float
) -> None:
    arm, workspace = ONE_SECTION[name], WORKSPACES[name]
    rng = np.random.default_rng(seed)
    names = LimitNames(arm)
    lengths = random_lengths(arm, rng)
    chamber, up = rng.integers(3), rng.integers(2)
    bound = names.upper_m if up else names.lower_m
    lengths[0, chamber] = bound[0, chamber] + (beyond if up else -beyond)
    answer = workspace.is_reachable(tip(arm, lengths))
    assert not answer.reachable
    assert answer.limits != 0
    assert answer.distance_m > 0.0
    assert isinstance(workspace.region, SolvedRegion)
    wanted = PressureLimit.bit if name == "table1" else LengthLimit.bit
    assert wanted & workspace.region.exceeded(tip(arm, lengths))


@given(angle=st.floats(-np.pi, np.pi), beyond=st.floats(1e-7, 0.1))
def test_a_bend_beyond_its_limit_gives_no_member(angle: float, beyond: float) -> None:
    for sign, reachable in ((-1.0, True), (1.0, False)):
        theta = PAPER_SECTION.bend_max_rad + sign * beyond
        shape = np.array([0.2, theta * np.cos(angle), theta * np.sin(angle)])
        lengths = lengths_from_shapes(shape, PAPER_SECTION.chamber_offset_m)[None]
        position = tip(paper_arm(), lengths)
        region = WORKSPACES["paper"].region
        assert isinstance(region, SolvedRegion)
        assert WORKSPACES["paper"].contains(position) == reachable
        assert region.exceeded(position) == (0 if reachable else BendLimit.bit)


@every_section
@given(seed=SEEDS, scale=st.floats(1.0 + 1e-6, 3.0))
def test_points_beyond_the_boundary_along_a_ray_from_inside_are_not_members(
    name: str, seed: int, scale: float
) -> None:
    # Seen in shapes the workspace is convex, so what is further out on a ray stays out.
    arm, rng = ONE_SECTION[name], np.random.default_rng(seed)
    region = SectionRegion(arm)
    sheet, across, along = np.array(rng.integers(3)), rng.uniform(size=1), rng.uniform(size=1)
    phi = WEDGE_RAD * across
    arc_length, theta = region.shapes(sheet, phi, along)
    middle = 0.5 * (region.lower_m + region.upper_m)
    arc_length, theta = middle + scale * (arc_length - middle), scale * theta
    shape = np.stack([arc_length, theta * np.cos(phi), theta * np.sin(phi)], axis=-1)
    outside = tip(arm, lengths_from_shapes(shape, region.offset_m)[:, None])
    if theta[0] < 2.0 * np.pi and arc_length[0] > 0.0:
        assert not WORKSPACES[name].contains(outside)
    on_it = region.points(sheet, phi, along)[0]
    assert WORKSPACES[name].contains(on_it)


@every_section
def test_the_nearest_point_is_that_of_a_global_search(name: str) -> None:
    workspace, rng = WORKSPACES[name], np.random.default_rng(1)
    assert isinstance(workspace.region, SolvedRegion)
    tree = cKDTree(boundary_cloud(workspace.region.region, 200))
    targets = rng.uniform((-0.4, -0.4, -0.3), (0.4, 0.4, 0.5), (150, 3))
    targets = targets[~workspace.contains(targets)]
    assert len(targets) > 60
    brute, _ = tree.query(targets)
    answers = [workspace.is_reachable(target) for target in targets]
    distance = np.array([answer.distance_m for answer in answers])
    assert (distance - brute).max() < 1e-4
    nearest = np.array([answer.nearest_m for answer in answers])
    np.testing.assert_allclose(np.linalg.norm(targets - nearest, axis=1), distance, atol=1e-12)
    assert workspace.contains(nearest).all()


@every_section
@given(seed=SEEDS)
def test_next_to_the_boundary_the_nearest_point_is_no_further_than_it(name: str, seed: int) -> None:
    region, rng = SectionRegion(ONE_SECTION[name]), np.random.default_rng(seed)
    sheet, phi, along = rng.integers(3), WEDGE_RAD * rng.uniform(), rng.uniform()
    turn = 2.0 * WEDGE_RAD * rng.integers(3)
    on_it = unfolded(region.points(np.array(sheet), phi, along), turn, rng.choice([-1.0, 1.0]))
    answer = WORKSPACES[name].is_reachable(on_it + 1e-5 * rng.standard_normal(3))
    offset = np.linalg.norm(answer.nearest_m - on_it)
    assert answer.distance_m < 6e-5
    assert offset < 2e-4


@every_section
def test_no_member_at_random_is_nearer_than_the_nearest_point(name: str) -> None:
    arm, rng = ONE_SECTION[name], np.random.default_rng(2)
    members = tip(arm, np.array([random_lengths(arm, rng) for _ in range(2000)]))
    for target in rng.uniform(-0.5, 0.5, (50, 3)):
        answer = WORKSPACES[name].is_reachable(target)
        assert np.linalg.norm(members - target, axis=1).min() >= answer.distance_m - 1e-9


@pytest.mark.parametrize(
    ("name", "position", "nearest", "limits"),
    [
        ("paper", (0.0, 0.0, 0.5), (0.0, 0.0, 0.299999), LengthLimit.bit),
        ("paper", (0.0, 0.0, 0.05), (0.0, 0.0, 0.100001), LengthLimit.bit),
        ("paper", (0.0, 0.0, 0.3), (0.0, 0.0, 0.299999), LengthLimit.bit),
        ("paper", (0.0, 0.0, 0.0), (0.0, 0.0, 0.100001), LengthLimit.bit),
        ("table1", (0.0, 0.0, 0.1), (0.0, 0.0, 0.17172), PressureLimit.bit),
        ("table1", (0.0, 0.0, 0.5), (0.0, 0.0, 0.225903), PressureLimit.bit),
    ],
)
def test_the_nearest_point_on_the_axis_is_at_the_end_of_the_travel(
    name: str, position: tuple[float, ...], nearest: tuple[float, ...], limits: int
) -> None:
    answer = WORKSPACES[name].is_reachable(position)
    assert not answer.reachable
    assert answer.limits == limits
    np.testing.assert_allclose(answer.nearest_m, nearest, atol=1e-6)


def test_a_target_that_only_bends_too_far_is_stopped_by_the_bend() -> None:
    assert WORKSPACES["paper"].is_reachable((0.19, 0.0, 0.0)).limits == BendLimit.bit


@every_section
def test_the_limits_are_those_that_the_lengths_at_the_nearest_point_touch(name: str) -> None:
    arm, rng, seen = ONE_SECTION[name], np.random.default_rng(3), set[int]()
    region = SectionRegion(arm)
    bend = BendLimit(arm)
    for target in rng.uniform((-0.4, -0.4, -0.2), (0.4, 0.4, 0.4), (100, 3)):
        answer = WORKSPACES[name].is_reachable(target)
        lengths = WORKSPACES[name].lengths_m(answer.nearest_m)
        slack = min((lengths - region.lower_m).min(), (region.upper_m - lengths).min())
        travel = LengthLimit.bit | PressureLimit.bit
        assert bool(answer.limits & travel) == (slack < AT_BOUND_M and not answer.reachable)
        bent = bend.left_m(lengths)[0] < AT_BOUND_M and not answer.reachable
        assert bool(answer.limits & BendLimit.bit) == bent
        seen.add(answer.limits)
    assert len(seen) > (name != "table1")  # its bend never binds


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_folding_ends_in_the_wedge_and_unfolding_undoes_it(vector: tuple[float, ...]) -> None:
    inside, turn, side = folded(np.array(vector))
    assert -1e-9 <= np.arctan2(inside[1] + 1e-300, inside[0]) <= WEDGE_RAD + 1e-9 or (
        np.hypot(*inside[:2]) < 1e-9
    )
    np.testing.assert_allclose(unfolded(inside, turn, side), vector, atol=1e-12)


def test_behind_the_base_nothing_is_reachable_and_nothing_is_raised() -> None:
    workspace = WORKSPACES["paper"]
    for z in (0.0, -1e-9, -0.2, -5.0):
        assert not workspace.is_reachable((0.0, 0.0, z)).reachable
        assert not workspace.is_reachable((1e-12, 0.0, z)).reachable


@pytest.mark.parametrize(
    ("position", "words"),
    [
        ((0.0, 0.0), r"shape \(2,\); allowed: \(3,\)"),
        (np.zeros((2, 3)), r"shape \(2, 3\); allowed: \(3,\)"),
        ((0.0, np.nan, 0.2), r"position_m = \[0.0, nan, 0.2\]: every coordinate must be finite"),
        ((0.0, np.inf, 0.2), "must be finite"),
        ("here", "three numbers"),
    ],
)
def test_bad_positions_are_refused_with_name_value_and_what_is_allowed(
    position: object, words: str
) -> None:
    for arm in (paper_arm(), trunk_arm()):
        with pytest.raises(InvalidInput, match=words):
            Workspace(arm).is_reachable(position)


def test_in_a_batch_the_index_of_the_bad_position_is_named() -> None:
    positions = np.full((4, 3), 0.1)
    positions[2, 1] = np.nan
    with pytest.raises(InvalidInput, match=r"position_m\[2\] = \[0.1, nan, 0.1\]"):
        WORKSPACES["paper"].contains(positions)


def test_the_region_of_one_section_refuses_an_arm_of_three() -> None:
    with pytest.raises(InvalidInput, match="'trunk' has 3 sections; allowed: 1"):
        SectionRegion(trunk_arm())


def test_membership_costs_no_search_inside() -> None:
    """What the gateway asks for every target is one solution of the inverse, not a search."""
    workspace = WORKSPACES["paper"]
    inside, far = (0.03, 0.02, 0.2), (0.3, 0.1, 0.2)

    def best_s(position: tuple[float, float, float]) -> float:
        return min(timeit.repeat(lambda: workspace.is_reachable(position), repeat=50, number=1))

    assert best_s(inside) < best_s(far)

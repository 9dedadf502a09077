"""The Cosserat rod against what is known of rods, and against scipy's collocation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths, tip_transform
from pneuarm.controllers.kinematics.models.cosserat_rod import (
    CosseratRod,
    RodProperties,
    three_springs,
)
from pneuarm.controllers.kinematics.models.rod_integration import motion
from tools.rig.arms import ARMS, paper_arm, random_lengths

G = 9.81
BENT = np.array([[0.17, 0.2, 0.25]])
SOFT = RodProperties(0.05, 60.0, 0.8, twisting_n_m2=0.04, shear_n=30.0)


def mounted(*gravity: float) -> Arm:
    return replace(paper_arm(), gravity_m_s2=gravity)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_without_gravity_the_rod_is_the_arc_of_constant_curvature(arm: Arm) -> None:
    rng = np.random.default_rng(5)
    lengths = np.array([random_lengths(arm, rng) for _ in range(20)])
    free = replace(arm, gravity_m_s2=(0.0, 0.0, 0.0))
    tips = CosseratRod(SOFT, steps=4).tip_transform(free, lengths)
    np.testing.assert_allclose(tips, tip_transform(arm, lengths), rtol=0.0, atol=2e-14)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_straight_rod_along_gravity_stretches_by_half_its_weight(direction: float) -> None:
    rod = RodProperties(1.0, 60.0, 0.8)
    tip = CosseratRod(rod).tip_transform(mounted(0.0, 0.0, direction * G), np.full((1, 3), 0.2))
    stretch = 0.8 * G * 0.2**2 / (2.0 * 60.0)
    np.testing.assert_allclose(tip[:3, 3], [0.0, 0.0, 0.2 + direction * stretch], atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_stiff_rod_across_gravity_sags_as_a_beam(axis: int) -> None:
    gravity = np.zeros(3)
    gravity[axis] = G
    rod = RodProperties(100.0, 1e9, 0.8, shear_n=500.0)
    tip = CosseratRod(rod).tip_transform(mounted(*gravity), np.full((1, 3), 0.2))
    weight = 0.8 * G
    beam = weight * 0.2**4 / (8.0 * 100.0) + weight * 0.2**2 / (2.0 * 500.0)
    assert tip[axis, 3] == pytest.approx(beam, rel=1e-6)
    assert tip[2, 0 if axis == 0 else 1] == pytest.approx(-weight * 0.2**3 / 600.0, rel=1e-6)


@pytest.mark.parametrize("gravity", [(0, 0, G), (G, 0, 0), (-3.0, 7.0, -4.0)])
def test_the_shooting_agrees_with_collocation(gravity: tuple[float, float, float]) -> None:
    arm = mounted(*gravity)
    tip = CosseratRod(SOFT).tip_transform(arm, BENT)
    np.testing.assert_allclose(tip, by_collocation(arm, SOFT), rtol=0.0, atol=3e-7)


def by_collocation(arm: Arm, rod: RodProperties) -> np.ndarray:
    """The same rod as a boundary value problem in scipy: position, quaternion, moment."""
    length, u, v = shapes_from_lengths(BENT, 0.038)[0]
    rest, weight = 0.2, rod.density_kg_m * np.array(arm.gravity_m_s2)
    k0 = np.array([-v, u, 0.0])[:, None] / rest
    give = 1.0 / np.array([rod.bending_n_m2, rod.bending_n_m2, rod.twisting_n_m2])[:, None]
    soft = 1.0 / np.array([rod.shear_n, rod.shear_n, rod.axial_n])[:, None]

    def slopes(s: np.ndarray, state: np.ndarray) -> np.ndarray:
        q, m = state[3:7], state[7:]
        n = weight[:, None] * (rest - s)
        k = k0 + give * turn(q, m, -1.0)
        v_ = np.array([[0.0], [0.0], [length / rest]]) + soft * turn(q, n, -1.0)
        forward = turn(q, v_, 1.0)
        w, x = q[0], q[1:]
        dq = 0.5 * np.vstack([-(x * k).sum(0), w * k + np.cross(x.T, k.T).T])
        return np.vstack([forward, dq, -np.cross(forward.T, n.T).T])

    def ends(base: np.ndarray, tip: np.ndarray) -> np.ndarray:
        return np.concatenate([base[:7] - [0, 0, 0, 1, 0, 0, 0], tip[7:]])

    nodes = np.linspace(0.0, rest, 30)
    guess = np.zeros((10, 30))
    guess[2], guess[3] = nodes, 1.0
    solved = solve_bvp(slopes, ends, nodes, guess, tol=1e-8, max_nodes=20000)
    assert solved.success
    end = solved.y[:, -1:]
    transform = np.eye(4)
    transform[:3, :3] = np.hstack([turn(end[3:7], np.eye(3)[:, [i]], 1.0) for i in range(3)])
    transform[:3, 3] = end[:3, 0]
    return transform


def turn(q: np.ndarray, vectors: np.ndarray, sign: float) -> np.ndarray:
    """Turn vectors (3, n) by quaternions (4, n), or back with a sign of -1."""
    w, x = q[0], sign * q[1:]
    once = np.cross(x.T, vectors.T).T
    return vectors + 2.0 * (w * once + np.cross(x.T, once.T).T)


def test_halving_the_steps_changes_little_and_in_the_fourth_order() -> None:
    arm = mounted(0.0, 0.0, G)
    exact = CosseratRod(SOFT, steps=96).tip_transform(arm, BENT)[:3, 3]
    errors = [
        np.linalg.norm(CosseratRod(SOFT, steps=n).tip_transform(arm, BENT)[:3, 3] - exact)
        for n in (6, 12, 24)
    ]
    assert errors[2] < 1e-7
    assert 8.0 < errors[0] / errors[1] < 40.0
    assert 8.0 < errors[1] / errors[2] < 40.0


def test_turning_the_arm_and_gravity_about_the_backbone_turns_the_tip() -> None:
    rod = CosseratRod(SOFT)
    c, s = np.cos(2.0 * np.pi / 3.0), np.sin(2.0 * np.pi / 3.0)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    gravity = np.array([4.0, 1.0, 8.0])
    tip = rod.tip_transform(mounted(*gravity), BENT)
    other = rod.tip_transform(mounted(*(turned @ gravity)), np.roll(BENT, 1, axis=-1))
    np.testing.assert_allclose(other[:3, 3], turned @ tip[:3, 3], atol=1e-10)
    np.testing.assert_allclose(other[:3, :3], turned @ tip[:3, :3] @ turned.T, atol=1e-9)


def test_two_half_sections_are_one_whole() -> None:
    half = replace(paper_arm().sections[0], rest_length_m=0.1, length_min_m=0.05)
    halves = Arm("halves", (half, half), (2.0, -3.0, 8.0))
    whole = mounted(2.0, -3.0, 8.0)
    tip = CosseratRod(SOFT).tip_transform(halves, np.concatenate([BENT, BENT]) / 2.0)
    np.testing.assert_allclose(tip, CosseratRod(SOFT).tip_transform(whole, BENT), atol=1e-7)


def test_an_arm_that_hangs_is_pulled_straight_and_one_that_stands_is_bent() -> None:
    rod = CosseratRod(three_springs(0.038, 1.0, 180.0 / G))

    def sideways(gravity: float) -> float:
        tip = rod.tip_transform(mounted(0.0, 0.0, gravity), BENT)
        return float(np.hypot(tip[0, 3], tip[1, 3]))

    assert sideways(G) < 0.97 * sideways(0.0)
    assert sideways(-G) > 1.03 * sideways(0.0)


def test_three_springs_tie_the_axial_to_the_bending_stiffness() -> None:
    rod = three_springs(0.04, 3.0, 1.0)
    assert rod.axial_n == pytest.approx(2.0 * 3.0 / 0.04**2)


def test_the_exponential_is_a_motion_and_continuous_where_the_series_ends() -> None:
    screws = np.array([0.3, -0.2, 1.0, 0.4, 0.5, -0.6]) * np.ones((2, 1))
    unit = screws[0, 3:] / np.linalg.norm(screws[0, 3:])
    screws[:, 3:] = np.array([[0.01 - 1e-12], [0.01 + 1e-12]]) * unit
    below, above = motion(screws)
    np.testing.assert_allclose(below, above, rtol=0.0, atol=3e-12)
    np.testing.assert_allclose(below[:3, :3] @ below[:3, :3].T, np.eye(3), atol=1e-15)
    half = motion(0.5 * screws[0])
    np.testing.assert_allclose(half @ half, below, atol=1e-15)


@pytest.mark.parametrize(
    ("numbers", "text"),
    [
        ((0.0, 1.0, 1.0), "bending_n_m2 = 0: it must be above 0"),
        ((np.inf, 1.0, 1.0), "bending_n_m2 = inf"),
        ((1.0, -1.0, 1.0), "axial_n = -1"),
        ((1.0, 1.0, -0.1), "density_kg_m = -0.1"),
        ((1.0, 1.0, np.nan), "density_kg_m = nan"),
    ],
)
def test_a_rod_that_cannot_be_is_refused(numbers: tuple[float, ...], text: str) -> None:
    with pytest.raises(InvalidInput, match=text):
        RodProperties(*numbers)


def test_an_offset_that_cannot_be_is_refused() -> None:
    with pytest.raises(InvalidInput, match="chamber_offset_m = 0"):
        three_springs(0.0, 1.0, 1.0)
    with pytest.raises(InvalidInput, match="steps = 0"):
        CosseratRod(SOFT, steps=0)


def test_where_no_rest_is_found_the_answer_is_nan_and_the_others_stand() -> None:
    arm = mounted(3.0, 1.0, -G)
    lengths = np.array([[[0.2, 0.2, 0.2]], [[1e9, 2e9, 1.5e9]], BENT])
    tips = CosseratRod(RodProperties(1.0, 1e3, 10.0)).tip_transform(arm, lengths)
    assert np.isnan(tips[1]).all()
    assert np.isfinite(tips[[0, 2]]).all()


def test_a_rod_far_too_soft_gives_a_rest_or_nan_and_no_other_error() -> None:
    tip = CosseratRod(RodProperties(1e-6, 1e-3, 50.0)).tip_transform(mounted(3, 1, -G), BENT)
    assert np.isnan(tip).all() or np.isfinite(tip).all()

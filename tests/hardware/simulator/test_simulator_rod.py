"""The simulated body: its mechanics, its lowest mode, and what gravity does to it."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import section_inverse, tip_transform
from pneuarm.hardware.simulator.chain import Chain
from pneuarm.hardware.simulator.parameters import DrawnParameters, draw
from pneuarm.hardware.simulator.rod import Rod
from tests.hardware.simulator.test_simulator import NOMINAL, PAPER, TRUNK

GRAVITIES = {
    "hanging": (0.0, 0.0, 9.81),
    "weightless": (0.0, 0.0, 0.0),
    "sideways": (9.81, 0.0, 0.0),
    "upside down": (0.0, 0.0, -9.81),
}


def nominal_rod(arm: Arm, lowest_mode_hz: float = NOMINAL.lowest_mode_hz) -> Rod:
    """Return the arm with every factor at 1."""
    values = replace(NOMINAL, lowest_mode_hz=lowest_mode_hz)
    return Rod(arm, DrawnParameters(0, values, values, (1.0,) * arm.n_sections))


def under(gravity: str, arm: Arm = PAPER) -> Arm:
    """Return the arm under another gravity."""
    return replace(arm, gravity_m_s2=GRAVITIES[gravity])


def settle(rod: Rod, lengthening_m: Array, duration_s: float = 4.0) -> tuple[Array, Array]:
    """Tip position and rotation after holding the lengthenings (n_chambers,)."""
    for _ in range(round(duration_s / 2.5e-3)):
        rod.step(lengthening_m, 2.5e-3)
    return rod.tip()


def energy_j(rod: Rod) -> float:
    """Kinetic, elastic and gravity's energy."""
    loaded, stretch = rod.loaded, rod.shapes - rod.loaded.rest
    kinetic = 0.5 * rod.rates @ loaded.mass_matrix(rod.shapes) @ rod.rates
    elastic = 0.5 * stretch @ (loaded.stiffness * stretch)
    masses = loaded.weights[: 3 * loaded.chain.n_segments : 3] ** 2
    heights = loaded.chain.pose(rod.shapes)[0] @ np.array(PAPER.gravity_m_s2)
    return float(kinetic + elastic - masses @ heights)


def ring_down(rod: Rod, step_s: float) -> tuple[float, float]:
    """Frequency (Hz) and damping ratio from the tip after a sideways release."""
    still = rod.tip()[0][0]
    rod.shapes[1::3] += 0.05 / rod.loaded.chain.n_segments
    offsets = []
    for _ in range(round(1.5 / step_s)):
        rod.step(np.zeros(3 * rod.loaded.chain.n_segments // 5), step_s)
        offsets.append(rod.tip()[0][0] - still)
    size = np.abs(offsets)
    peaks = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
    first, second = [peak for peak in peaks if peak * step_s > 0.2][:3:2]
    decrement = np.log(size[first] / size[second])
    frequency = 1.0 / ((second - first) * step_s)
    return frequency, decrement / np.hypot(decrement, 2.0 * np.pi)


def random_chain(n_segments: int) -> tuple[Chain, Array, Array, Array]:
    """Return a weightless chain, bent shapes, rates and weights; isotropic lumps."""
    rng, size = np.random.default_rng(n_segments), 3 * n_segments
    shapes = np.tile([0.04, 0.5, -0.3], n_segments) + 0.01 * rng.normal(size=size)
    weights = np.repeat(rng.uniform(0.1, 1.0, 2 * n_segments), 3)
    return Chain(n_segments, (0.0, 0.0, 0.0)), shapes, rng.normal(size=size), weights


@pytest.mark.parametrize("n_segments", [1, 4])
def test_jacobian_agrees_with_the_derivative_of_the_pose(n_segments: int) -> None:
    """Central differences: every lump's position, and the turn of the last one."""
    chain, shapes, rates, _ = random_chain(n_segments)
    jacobian = chain.dynamics(shapes, rates, np.ones(6 * n_segments))[0].copy()
    for row, step in zip(jacobian, 1e-6 * np.eye(shapes.size), strict=True):
        ahead, turned_ahead = (part.copy() for part in chain.pose(shapes + step))
        behind, turned_behind = chain.pose(shapes - step)
        moved = (ahead - behind).reshape(-1) / 2e-6
        np.testing.assert_allclose(row[: 3 * n_segments], moved, atol=1e-8)
        spin = (turned_ahead - turned_behind) / 2e-6 @ chain.pose(shapes)[1].T
        np.testing.assert_allclose(row[-3:], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-8)


@pytest.mark.parametrize("n_segments", [1, 4])
def test_the_velocities_force_is_the_one_of_lagrange(n_segments: int) -> None:
    """``M' q' - grad(q' M q' / 2)`` by differences of the mass matrix."""
    chain, shapes, rates, weights = random_chain(n_segments)

    def mass(at: Array) -> Array:
        jacobian, _ = chain.dynamics(at, rates, weights)
        return jacobian @ jacobian.T

    slopes = [(mass(shapes + s) - mass(shapes - s)) / 2e-6 for s in 1e-6 * np.eye(shapes.size)]
    needed = np.einsum("kij,k,j->i", slopes, rates, rates)
    needed -= 0.5 * np.einsum("kij,i,j->k", slopes, rates, rates)
    jacobian, imposed = chain.dynamics(shapes, rates, weights)
    np.testing.assert_allclose(-(jacobian @ imposed), needed, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("gravity", GRAVITIES)
def test_lowest_mode_and_damping_of_the_worst_arms_that_can_be_drawn(gravity: str) -> None:
    """At the corners of the variation, so over every seed: 1.5 to 3 Hz, 0.1 to 0.2."""
    modes = []
    for mass, stiffness, axial in product((0.8, 1.2), repeat=3):
        values = replace(
            NOMINAL,
            mass_per_length_kg_m=mass * NOMINAL.mass_per_length_kg_m,
            plate_mass_kg=mass * NOMINAL.plate_mass_kg,
            axial_stiffness_ratio=axial,
        )
        modes.append(
            Rod(under(gravity), DrawnParameters(0, NOMINAL, values, (stiffness,))).lowest_mode_hz
        )
    assert 1.5 < min(modes) < 2.2 < max(modes) < 3.0
    assert 0.8 * NOMINAL.damping_ratio > 0.1
    assert 1.2 * NOMINAL.damping_ratio < 0.2


@pytest.mark.parametrize("step_s", [1e-3, 2.5e-3])
@pytest.mark.parametrize(("arm", "seed"), [(PAPER, 0), (PAPER, 1), (PAPER, 2), (TRUNK, 3)])
def test_ring_down_shows_the_drawn_mode_and_damping(arm: Arm, seed: int, step_s: float) -> None:
    """A free decay after a sideways release, at any step: what is drawn is what is seen."""
    drawn = draw(NOMINAL, seed, arm.n_sections)
    rod = Rod(arm, drawn)
    frequency, damping = ring_down(rod, step_s)
    damped = rod.lowest_mode_hz * np.sqrt(1.0 - drawn.values.damping_ratio**2)
    assert frequency == pytest.approx(damped, rel=0.02)
    assert damping == pytest.approx(drawn.values.damping_ratio, abs=0.01)
    assert 1.5 < frequency < 3.0
    assert 0.1 < damping < 0.2


def test_energy_decays_without_actuation() -> None:
    """Released bent, stretched and moving: never more energy than 50 ms before, rest in the end."""
    rod = nominal_rod(PAPER)
    least = energy_j(rod)
    rod.shapes += np.tile([0.005, 0.2, -0.1], 5)
    rod.rates[:] = np.tile([0.0, 1.0, 2.0], 5)
    energies = []
    for index in range(4000):
        if index % 50 == 0:
            energies.append(energy_j(rod) - least)
        rod.step(np.zeros(3), 1e-3)
    assert np.diff(energies).max() < 1e-6 * energies[0]
    assert 0.0 <= energies[-1] < 1e-4 * energies[0]


def test_hanging_arm_is_stretched_by_what_it_carries() -> None:
    """At rest every sub-segment carries what is below it; the rates stay zero."""
    rod = nominal_rod(PAPER)
    masses = rod.loaded.weights[:15:3] ** 2
    carried_n = 9.81 * np.cumsum(masses[::-1])[::-1]
    expected_m = np.sum(0.04 + carried_n / rod.loaded.stiffness[::3])
    position, rotation = settle(rod, np.zeros(3), 0.5)
    np.testing.assert_allclose(position, [0.0, 0.0, expected_m], atol=1e-9)
    np.testing.assert_allclose(rotation, np.eye(3), atol=1e-9)
    assert np.abs(rod.rates).max() < 1e-9


def test_lumps_weigh_what_the_arm_weighs() -> None:
    """All but the half sub-segment that its base carries, and a plate at each section's end."""
    masses = nominal_rod(TRUNK).loaded.weights[:45:3] ** 2
    assert masses.sum() == pytest.approx(1.5 * (0.6 - 0.02) + 3 * 0.05)
    np.testing.assert_allclose(masses[[0, 4, 14]], [0.06, 0.06 + 0.05, 0.03 + 0.05])


@pytest.mark.parametrize("lengthening_m", [-0.08, 0.08])
def test_equal_chambers_keep_a_hanging_arm_straight(lengthening_m: float) -> None:
    """No direction is distinguished: the tip moves along z alone, and by the lengthening."""
    rod = nominal_rod(PAPER)
    before = rod.tip()[0][2]
    position, _ = settle(rod, np.full(3, lengthening_m))
    np.testing.assert_allclose(position[:2], 0.0, atol=1e-9)
    assert position[2] - before == pytest.approx(lengthening_m, abs=1e-6)


def test_weightless_arm_rests_in_the_arc_of_constant_curvature() -> None:
    """The moment is constant along the arc; the drawn stiffness is an error of the gain."""
    lengthening_m = np.array([-0.03, 0.01, 0.02])
    drawn = replace(draw(NOMINAL, 4, 1), values=NOMINAL, stiffness_factors=(0.8,))
    for rod, gain in (
        (nominal_rod(under("weightless")), 1.0),
        (Rod(under("weightless"), drawn), 1.25),
    ):
        expected = tip_transform(PAPER, PAPER.rest_lengths_m + gain * lengthening_m)
        position, rotation = settle(rod, lengthening_m, 8.0)
        np.testing.assert_allclose(position, expected[:3, 3], atol=1e-6)
        np.testing.assert_allclose(rotation, expected[:3, :3], atol=1e-5)


def test_weightless_trunk_rests_in_the_arcs_of_its_sections() -> None:
    """Three sections with different lengthenings, the product of their arcs."""
    lengthening_m = np.array([[-0.02, 0.01, 0.02], [0.03, 0.0, -0.01], [0.0, -0.02, 0.01]])
    expected = tip_transform(TRUNK, TRUNK.rest_lengths_m + lengthening_m)
    position, _ = settle(nominal_rod(under("weightless", TRUNK)), lengthening_m.reshape(-1), 5.0)
    np.testing.assert_allclose(position, expected[:3, 3], atol=1e-5)


def test_gravity_pulls_a_hanging_arm_out_of_its_arc() -> None:
    """It deflects less than constant curvature says, and what it rests in is no arc."""
    lengthening_m = np.array([-0.04, 0.02, 0.02])
    arc = tip_transform(PAPER, PAPER.rest_lengths_m + lengthening_m)[:3, 3]
    position, rotation = settle(nominal_rod(PAPER), lengthening_m)
    assert 0.4 * arc[0] < position[0] < 0.9 * arc[0]
    _, u, _ = section_inverse(position)
    own_bend = np.arctan2(rotation[0, 2], rotation[2, 2])
    assert abs(own_bend - u) > np.deg2rad(2.0)


def test_sideways_arm_sags_along_gravity() -> None:
    """At rest it hangs down to one side, and stays there."""
    rod = nominal_rod(under("sideways"))
    sagged = rod.tip()[0]
    assert 0.03 < sagged[0] < 0.12
    np.testing.assert_allclose(settle(rod, np.zeros(3), 0.5)[0], sagged, atol=1e-8)


def test_an_arm_that_cannot_hold_itself_is_refused() -> None:
    """Upside down with barely any reserve, a softer one falls; the text says what to do."""
    nominal = replace(NOMINAL, lowest_mode_hz=0.6)
    drawn = DrawnParameters(0, nominal, nominal, (0.8,))
    with pytest.raises(InvalidInput, match="raise lowest_mode_hz"):
        Rod(under("upside down"), drawn)


def test_an_arm_that_its_weight_stretches_by_half_is_refused() -> None:
    """Soft beyond what the equations are good for, where they would turn it inside out."""
    drawn = DrawnParameters(0, NOMINAL, NOMINAL, (0.05,))
    with pytest.raises(InvalidInput, match="more than 50%"):
        Rod(PAPER, drawn)


def test_a_mode_that_no_stiffness_gives_is_refused() -> None:
    """A hanging arm never swings slower than the pendulum that it is."""
    with pytest.raises(InvalidInput, match=r"lowest_mode_hz = 0\.05"):
        nominal_rod(PAPER, 0.05)

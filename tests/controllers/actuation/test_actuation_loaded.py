"""The calibrated map: load, coupling, hysteresis; its inverse, its gradient, its bounds."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuarm.controllers.actuation.inverse_play import CROSSING, InversePlay
from pneuarm.controllers.actuation.pressure_map import (
    PressureMap,
    length_bounds_m,
    pressure_length_bounds_m,
    symbolic_pressures,
)
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.calibration.hysteresis import play_outputs
from pneuarm.controllers.kinematics.compiled import symbolic_section
from pneuarm.controllers.kinematics.constant_curvature import curve_transforms, shapes_from_lengths
from pneuarm.controllers.kinematics.gravity import masses_kg, symbolic_potential
from tools.rig.arms import ARMS, PAPER_SECTION, paper_arm, random_lengths

COUPLING = ((1.05, 0.02, -0.05), (0.03, 0.95, 0.01), (-0.02, 0.01, 1.0))


def loaded(arm: Arm, gravity: tuple[float, float, float] = (1.0, -2.0, 9.0)) -> Arm:
    """Return an arm that gravity bends by a fifth and stretches by some percent, obliquely."""
    sections = tuple(
        replace(
            section,
            coupling=COUPLING,
            bending_compliance_rad_per_n_m=1.5 / arm.n_sections**2,
            axial_compliance_m_per_n=1e-3,
        )
        for section in arm.sections
    )
    return replace(arm, sections=sections, gravity_m_s2=gravity)


LOADED = {name: loaded(arm) for name, arm in ARMS.items()}
MAPS = {name: PressureMap(arm) for name, arm in LOADED.items()}


@pytest.mark.parametrize("name", LOADED)
@given(seed=st.integers(0, 2**32 - 1))
def test_loaded_lengths_come_back_from_their_pressures(name: str, seed: int) -> None:
    lengths = random_lengths(ARMS[name], np.random.default_rng(seed), 0.6)
    pressure_map = MAPS[name]
    pressures = pressure_map.pressures_pa(lengths)
    back = pressure_map.lengths_m(pressures, near_m=lengths + 1e-3)
    assert pressure_map.converged
    np.testing.assert_allclose(back, lengths, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(pressure_map.pressures_pa(back), pressures, rtol=1e-9, atol=1e-4)


@pytest.mark.parametrize("name", LOADED)
def test_a_cold_start_finds_the_same_lengths_over_the_whole_range(name: str) -> None:
    arm, pressure_map = LOADED[name], MAPS[name]
    rng = np.random.default_rng(5)
    low, high = arm.per_chamber("pressure_min_pa"), arm.per_chamber("pressure_max_pa")
    for _ in range(50):
        pressures = rng.uniform(low, high)
        lengths = pressure_map.lengths_m(pressures)
        assert pressure_map.converged
        np.testing.assert_allclose(pressure_map.pressures_pa(lengths), pressures, atol=1e-3)


def test_a_batch_of_loaded_lengths_is_mapped_element_by_element() -> None:
    pressure_map = MAPS["trunk"]
    rng = np.random.default_rng(3)
    batch = np.array([random_lengths(ARMS["trunk"], rng, 0.5) for _ in range(6)])
    pressures = pressure_map.pressures_pa(batch.reshape(2, 3, 3, 3))
    np.testing.assert_array_equal(pressures[1, 2], pressure_map.pressures_pa(batch[5]))
    back = pressure_map.lengths_m(pressures)
    np.testing.assert_allclose(back.reshape(batch.shape), batch, atol=1e-9)


@pytest.mark.parametrize("name", ARMS)
def test_a_neutral_load_changes_nothing(name: str) -> None:
    # A compliance without gravity goes through the compiled map: what comes out is today's.
    weightless = loaded(ARMS[name], (0.0, 0.0, 0.0))
    weightless = replace(
        weightless,
        sections=tuple(
            replace(section, coupling=plain.coupling)
            for section, plain in zip(weightless.sections, ARMS[name].sections, strict=True)
        ),
    )
    plain, compiled = PressureMap(ARMS[name]), PressureMap(weightless)
    lengths = random_lengths(ARMS[name], np.random.default_rng(1))
    np.testing.assert_allclose(
        compiled.pressures_pa(lengths), plain.pressures_pa(lengths), rtol=1e-13, atol=1e-9
    )
    pressures = plain.pressures_pa(lengths)
    np.testing.assert_allclose(compiled.lengths_m(pressures), lengths, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("name", LOADED)
def test_the_symbols_are_the_map(name: str) -> None:
    arm = LOADED[name]
    lengths = random_lengths(ARMS[name], np.random.default_rng(2), 0.5)
    symbol = ca.SX.sym("lengths", arm.n_chambers)
    function = ca.Function("pressures", [symbol], [symbolic_pressures(arm, symbol)])
    values = np.asarray(function(lengths.reshape(-1))).reshape(lengths.shape)
    np.testing.assert_allclose(values, MAPS[name].pressures_pa(lengths), rtol=1e-12, atol=1e-9)


def potential_j(arm: Arm, lengths: Array, points: int) -> float:
    """Energy of the weight by the midpoint rule along the curve that the other module draws."""
    offset = arm.per_section("chamber_offset_m")
    shares = masses_kg(arm.mass_kg, arm.sections)
    positions = curve_transforms(arm, lengths, points)[:, :3, 3]
    assert shapes_from_lengths(lengths, offset).shape == lengths.shape
    middle = 0.5 * (positions[1:] + positions[:-1])
    masses = np.repeat(np.array(shares) / points, points)
    return float(-(masses @ middle) @ np.array(arm.gravity_m_s2))


@pytest.mark.parametrize("name", LOADED)
def test_the_potential_energy_is_that_of_the_drawn_curve(name: str) -> None:
    arm = LOADED[name]
    lengths = random_lengths(ARMS[name], np.random.default_rng(4), 0.7)
    shapes = ca.SX.sym("shapes", arm.n_sections, 3)
    masses = masses_kg(arm.mass_kg, arm.sections)
    energy = ca.Function("v", [shapes], [symbolic_potential(shapes, masses, arm.gravity_m_s2)])
    offset = arm.per_section("chamber_offset_m")
    value = float(energy(shapes_from_lengths(lengths, offset)))
    assert value == pytest.approx(potential_j(arm, lengths, 2000), abs=1e-6)


@pytest.mark.parametrize("name", LOADED)
def test_the_load_is_the_compliance_times_the_gradient_of_the_energy(name: str) -> None:
    arm = LOADED[name]
    lengths = random_lengths(ARMS[name], np.random.default_rng(6), 0.7)
    offset = arm.per_section("chamber_offset_m")
    shapes = shapes_from_lengths(lengths, offset)
    symbol = ca.SX.sym("shapes", arm.n_sections, 3)
    masses = masses_kg(arm.mass_kg, arm.sections)
    energy = ca.Function("v", [symbol], [symbolic_potential(symbol, masses, arm.gravity_m_s2)])
    force = np.zeros_like(shapes)
    for index in np.ndindex(shapes.shape):
        change = np.zeros_like(shapes)
        change[index] = 1e-6
        force[index] = float(energy(shapes + change) - energy(shapes - change)) / 2e-6
    compliance = np.array(
        [
            [s.axial_compliance_m_per_n, *[s.bending_compliance_rad_per_n_m] * 2]
            for s in arm.sections
        ]
    )
    unloaded = shapes + compliance * force
    pressures = MAPS[name].pressures_pa(lengths)
    own = pressures * (
        arm.per_chamber("lengthening_m_per_pa")
        + arm.per_chamber("softening_m_per_pa2") * np.abs(pressures)
    )
    lengthened = arm.rest_lengths_m + own @ np.array(COUPLING).T
    np.testing.assert_allclose(shapes_from_lengths(lengthened, offset), unloaded, atol=1e-8)


def test_an_arm_that_hangs_is_longer_and_straighter_than_without_its_weight() -> None:
    arm = replace(loaded(paper_arm(), (0.0, 0.0, 9.81)))
    light = replace(arm, gravity_m_s2=(0.0, 0.0, 0.0))
    pressures = np.array([[0.6e5, 0.0, 0.0]])
    with_load, without = (
        shapes_from_lengths(PressureMap(each).lengths_m(pressures), 0.038)[0]
        for each in (arm, light)
    )
    assert with_load[0] > without[0] + 1e-3
    assert 0.6 < np.hypot(*with_load[1:]) / np.hypot(*without[1:]) < 0.97


def test_where_newton_does_not_converge_the_unloaded_lengths_are_given() -> None:
    arm = loaded(paper_arm())
    pressure_map = PressureMap(arm)
    pressures = np.array([[0.5e5, -0.3e5, 0.1e5]])
    lengths = pressure_map.lengths_m(pressures, near_m=np.full((1, 3), np.nan))
    assert not pressure_map.converged
    own = pressures * (1e-6 + 1.4e-12 * np.abs(pressures))
    np.testing.assert_allclose(lengths, 0.2 + own @ np.array(COUPLING).T, atol=1e-15)
    pressure_map.lengths_m(pressures)
    assert pressure_map.converged


@pytest.mark.parametrize("name", LOADED)
def test_the_bounds_hold_what_the_pressure_range_reaches_alike_in_all_sections(name: str) -> None:
    arm, pressure_map = LOADED[name], MAPS[name]
    low, high = pressure_length_bounds_m(arm)
    for share in np.random.default_rng(7).uniform(0.0, 1.0, (20, 3)):
        pressures = arm.per_chamber("pressure_min_pa") * (1 - share)
        pressures = pressures + arm.per_chamber("pressure_max_pa") * share
        lengths = pressure_map.lengths_m(pressures)
        assert (lengths > low - 2e-3).all()
        assert (lengths < high + 2e-3).all()
    inner = length_bounds_m(arm)
    assert (inner[0] < inner[1]).all()
    assert (inner[0] > arm.per_chamber("length_min_m")).all()


@pytest.mark.parametrize(
    ("coupling", "words"),
    [
        (((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "three rows of three"),
        (((1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), "independent"),
        (((float("nan"), 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), "finite"),
    ],
)
def test_a_coupling_that_cannot_be_inverted_is_refused(coupling: object, words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        replace(PAPER_SECTION, coupling=coupling)  # type: ignore[arg-type]


def sluggish_arm(half_width_pa: float = 2000.0) -> Arm:
    return Arm("sluggish", (replace(PAPER_SECTION, hysteresis_pa=half_width_pa),))


@settings(max_examples=25)
@given(
    st.lists(st.tuples(*[st.floats(-0.8e5, 0.8e5)] * 3), min_size=2, max_size=4),
    st.floats(500.0, 3000.0),
)
def test_the_inverse_play_makes_a_play_follow_once_it_has_crossed(
    corners: list[tuple[float, float, float]], half_width_pa: float
) -> None:
    inverse = InversePlay(sluggish_arm(half_width_pa))
    wanted = [np.zeros((1, 3))]
    for corner in corners:  # in steps as small as a controller's
        start, way = wanted[-1], np.array([corner]) - wanted[-1]
        steps = int(np.abs(way).max() / 200.0) + 1
        wanted += [start + way * (number + 1) / steps for number in range(steps)]
    sent = np.array([inverse.sent_pa(acting) for acting in wanted])
    acting, _ = play_outputs(sent, np.array([[half_width_pa]]))
    # Never farther off than the width; exact wherever the way since the turn was long enough.
    assert np.abs(acting - np.array(wanted)).max() <= half_width_pa * (1 + 1e-9)
    engaged = np.abs(sent[-1] - wanted[-1]) >= half_width_pa * (1 - 1e-9)
    np.testing.assert_allclose(acting[-1][engaged], np.array(wanted)[-1][engaged], atol=1e-6)


def test_the_inverse_play_never_jumps_and_repeats_itself_exactly() -> None:
    inverse = InversePlay(sluggish_arm())
    acting = np.array([[0.3e5, 0.0, -0.2e5]])
    first = inverse.sent_pa(acting)
    np.testing.assert_array_equal(inverse.sent_pa(acting), first)
    turned = inverse.sent_pa(acting - 10.0)
    assert np.abs(turned - first).max() <= 10.0 * (1.0 + 1.0 / CROSSING) + 1e-9


def test_the_inverse_play_started_from_what_was_sent_sends_that_again() -> None:
    inverse = InversePlay(sluggish_arm())
    sent = inverse.sent_pa(np.array([[0.3e5, 0.1e5, -0.2e5]])).copy()
    acting = inverse.start_from(sent)
    np.testing.assert_allclose(acting, [[0.3e5, 0.1e5, -0.2e5]], atol=1e-9)
    np.testing.assert_allclose(inverse.sent_pa(acting), sent, atol=1e-9)
    vented = inverse.start_from(np.zeros((1, 3)))
    np.testing.assert_allclose(vented, [[2000.0, 2000.0, -2000.0]])
    np.testing.assert_allclose(inverse.sent_pa(vented), np.zeros((1, 3)), atol=1e-9)


def test_pressures_asked_for_are_sent_as_they_are() -> None:
    inverse = InversePlay(sluggish_arm())
    inverse.sent_pa(np.array([[0.3e5, 0.1e5, -0.2e5]]))
    asked = np.array([[0.1e5, 0.4e5, 0.0]])
    np.testing.assert_allclose(inverse.sent_pa(asked, to_slack=True), asked)


def test_the_centre_of_mass_of_an_arc_is_the_mean_along_it() -> None:
    arc_length, u, v = 0.2, 0.9, -1.7
    shares, weights = np.polynomial.legendre.leggauss(20)
    shares, weights = 0.5 * (shares + 1.0), 0.5 * weights
    symbols = [ca.SX.sym(name) for name in "luv"]
    position = ca.Function("p", symbols, [symbolic_section(*symbols)[0]])
    points = [np.asarray(position(s * arc_length, s * u, s * v))[:, 0] for s in shares]
    mean = weights @ np.array(points)
    shapes = ca.SX.sym("shapes", 1, 3)
    for axis, unit in enumerate(np.eye(3)):
        energy = ca.Function("v", [shapes], [symbolic_potential(shapes, [1.0], unit.tolist())])
        assert float(energy(np.array([[arc_length, u, v]]))) == pytest.approx(-mean[axis], 1e-12)

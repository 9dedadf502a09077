"""The body in MuJoCo: its arc, its weight, its lowest mode, and what it touches."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import mujoco
import numpy as np
import pytest

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm, Array, HalfSpace, Sphere
from pneuarm.controllers.arm.errors import HardwareError, InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths, tip_transform
from pneuarm.hardware.mujoco.body import MujocoBody
from pneuarm.hardware.mujoco.model import compiled, turn_shares
from pneuarm.hardware.mujoco.statics import Statics
from pneuarm.hardware.simulator.parameters import DrawnParameters, SimulatorParameters, draw
from pneuarm.hardware.simulator.rod import Rod
from tests.hardware.mujoco.bodies import (
    ARMS,
    GRAVITIES,
    NOMINAL,
    PAPER,
    nominal,
    nominal_body,
    settle,
    under,
)

BENT_M = np.array([-0.04, 0.02, 0.02])


def random_lengthening_m(arm: Arm, rng: np.random.Generator) -> Array:
    """What the map makes of random pressures over the whole range, inside the arm's limits."""
    low, high = arm.per_chamber("pressure_min_pa"), arm.per_chamber("pressure_max_pa")
    shortest, longest = arm.length_interval_m
    while True:
        lengths_m = PressureMap(arm).lengths_m(rng.uniform(low, high))
        bends = np.hypot(*shapes_from_lengths(lengths_m, arm.per_section("chamber_offset_m")).T[1:])
        inside = ((lengths_m > shortest) & (lengths_m < longest)).all()
        if inside and (bends < arm.per_section("bend_max_rad")[:, 0]).all():
            return lengths_m - arm.rest_lengths_m


def rod_tip(arm: Arm, lengthening_m: Array) -> Array:
    """Where the tip of the simulator's own nominal body rests, (3,)."""
    values = SimulatorParameters()
    rod = Rod(arm, DrawnParameters(0, values, values, (1.0,) * arm.n_sections))
    for _ in range(1600):
        rod.step(lengthening_m, 2.5e-3)
    return rod.tip()[0]


@pytest.mark.parametrize("links", [2, 4, 10, 20])
def test_the_joints_share_the_whole_bend_from_either_end(links: int) -> None:
    shares = turn_shares(links)
    assert shares.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(shares, shares[::-1])
    assert (shares > 0.0).all()


@pytest.mark.parametrize("links", [0, 1, 3])
def test_a_chain_that_has_no_such_shares_is_refused(links: int) -> None:
    with pytest.raises(InvalidInput, match=f"segments_per_section = {links}"):
        turn_shares(links)


@pytest.mark.parametrize(("preset", "number"), [("paper", 12), ("table1", 12), ("trunk", 2)])
def test_a_weightless_arm_rests_in_the_arcs_of_constant_curvature(preset: str, number: int) -> None:
    """Within half a millimetre anywhere in its limits, and without twist."""
    arm = under("weightless", ARMS[preset])
    body, rng = nominal_body(arm), np.random.default_rng(3)
    for _ in range(number):
        lengthening_m = random_lengthening_m(arm, rng)
        body.reset()
        position, rotation = settle(body, lengthening_m)
        expected = tip_transform(arm, arm.rest_lengths_m + lengthening_m)
        assert np.linalg.norm(position - expected[:3, 3]) < 0.5e-3
        np.testing.assert_allclose(rotation, expected[:3, :3], atol=2e-3)


def test_the_drawn_stiffness_is_an_error_of_the_gain() -> None:
    arm = under("weightless")
    body = MujocoBody(arm, replace(nominal(arm), stiffness_factors=(0.8,)))
    position, _ = settle(body, BENT_M)
    expected = tip_transform(arm, arm.rest_lengths_m + 1.25 * BENT_M)[:3, 3]
    np.testing.assert_allclose(position, expected, atol=1e-4)


def test_a_hanging_arm_is_stretched_by_what_it_carries() -> None:
    """Every link carries itself and what is below it; the model weighs what the arm weighs."""
    model = compiled(PAPER, NOMINAL, ())
    assert model.body_mass.sum() == pytest.approx(1.5 * 0.2 + 0.05)
    masses = model.body_mass[1:]
    stiffness = model.jnt_stiffness[model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE].copy()
    carried_n = 9.81 * np.cumsum(masses[::-1])[::-1][:-1]
    bending_n_m2 = Statics(model).scale_for_mode(NOMINAL.lowest_mode_hz)
    position, rotation = settle(nominal_body(PAPER), np.zeros(3), 0.5)
    stretched_m = position[2] - 0.2
    assert stretched_m == pytest.approx(rod_tip(PAPER, np.zeros(3))[2] - 0.2, rel=0.1)
    assert bending_n_m2 == pytest.approx((carried_n / stiffness).sum() / stretched_m)
    np.testing.assert_allclose(position[:2], 0.0, atol=1e-9)
    np.testing.assert_allclose(rotation, np.eye(3), atol=1e-9)


def test_gravity_pulls_a_hanging_arm_out_of_its_arc_as_it_does_the_rod() -> None:
    """Two discretisations of one beam: less than constant curvature says, by about as much."""
    arc = tip_transform(PAPER, PAPER.rest_lengths_m + BENT_M)[:3, 3]
    position, _ = settle(nominal_body(PAPER), BENT_M)
    assert 0.4 * arc[0] < position[0] < 0.9 * arc[0]
    np.testing.assert_allclose(position, rod_tip(PAPER, BENT_M), atol=1.5e-3)


def test_a_sideways_arm_sags_along_gravity_and_stays_there() -> None:
    body = nominal_body(under("sideways"))
    sagged = body.tip()[0]
    assert 0.03 < sagged[0] < 0.12
    np.testing.assert_allclose(settle(body, np.zeros(3), 1.0)[0], sagged, atol=1e-7)


def test_what_bends_across_gravity_twists_and_sags_further_than_the_rod() -> None:
    """Its weight beside the base turns it about its own axis, which the rod cannot."""
    arm, lengthening_m = under("sideways"), np.array([0.03, -0.06, 0.06])
    position, _ = settle(nominal_body(arm), lengthening_m)
    assert position[0] - rod_tip(arm, lengthening_m)[0] > 0.01


@pytest.mark.parametrize("gravity", GRAVITIES)
def test_the_lowest_mode_of_the_worst_arms_that_can_be_drawn(gravity: str) -> None:
    """At the corners of the variation, so over every seed: 1.5 to 3 Hz; nominally 2.2 Hz."""
    arm = under(gravity)
    assert nominal_body(arm).lowest_mode_hz == pytest.approx(2.2, abs=1e-3)
    modes = []
    for mass, stiffness, axial in product((0.8, 1.2), repeat=3):
        values = replace(
            NOMINAL,
            mass_per_length_kg_m=mass * NOMINAL.mass_per_length_kg_m,
            plate_mass_kg=mass * NOMINAL.plate_mass_kg,
            axial_stiffness_ratio=axial,
        )
        drawn = DrawnParameters(0, NOMINAL, values, (stiffness,))
        modes.append(MujocoBody(arm, drawn).lowest_mode_hz)
    assert 1.5 < min(modes) < 2.2 < max(modes) < 3.0


@pytest.mark.parametrize("step_s", [1e-3, 2.5e-3])
@pytest.mark.parametrize("seed", range(3))
def test_ring_down_shows_the_drawn_mode_and_damping(seed: int, step_s: float) -> None:
    """A free decay after a release from the side, at any step: what is drawn is what is seen."""
    drawn = draw(NOMINAL, seed, 1)
    body = MujocoBody(PAPER, drawn)
    settle(body, 0.5 * BENT_M)
    offsets = []
    for _ in range(round(1.5 / step_s)):
        body.step(np.zeros(3), step_s)
        offsets.append(abs(body.tip()[0][0]))
    size = np.array(offsets)
    peaks = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
    first, second = [peak for peak in peaks if peak * step_s > 0.1][:3:2]
    decrement = np.log(size[first] / size[second])
    damped_hz = body.lowest_mode_hz * np.sqrt(1.0 - drawn.values.damping_ratio**2)
    assert 1.0 / ((second - first) * step_s) == pytest.approx(damped_hz, rel=0.02)
    damping = decrement / np.hypot(decrement, 2.0 * np.pi)
    assert damping == pytest.approx(drawn.values.damping_ratio, abs=0.01)


def test_the_way_does_not_hang_on_the_step() -> None:
    """Read every millisecond or every 20: the same swing."""
    fine, coarse = nominal_body(PAPER), nominal_body(PAPER)
    for _ in range(10):
        for _ in range(20):
            fine.step(BENT_M, 1e-3)
        coarse.step(BENT_M, 0.02)
        assert np.linalg.norm(fine.tip()[0] - coarse.tip()[0]) < 1e-3


@pytest.mark.parametrize("radius_m", [0.0, 0.02])
def test_a_half_space_stops_the_tip(radius_m: float) -> None:
    """At the distance of the arm's skin; without it the arm would go far beyond."""
    wall = HalfSpace((1.0, 0.0, 0.0), 0.05)
    free, _ = settle(nominal_body(PAPER), 2.0 * BENT_M)
    assert free[0] > 0.07
    arm = replace(PAPER, keep_outs=(wall,), body_radius_m=radius_m)
    position, _ = settle(nominal_body(arm), 2.0 * BENT_M)
    assert position[0] == pytest.approx(0.05 - max(radius_m, 1e-3), abs=1e-3)


def test_an_obstacle_that_the_arm_does_not_know_stops_it_too() -> None:
    """A floor for one that stretches; a ball for one that swings against it from the side."""
    floor = HalfSpace((0.0, 0.0, 1.0), 0.22)
    body = MujocoBody(PAPER, nominal(PAPER), (floor,))
    assert 0.215 < settle(body, np.full(3, 0.05))[0][2] < 0.2205
    ball = Sphere((0.1, 0.0, 0.18), 0.05)
    body = MujocoBody(PAPER, nominal(PAPER), (ball,))
    distances = []
    for _ in range(600):
        body.step(2.0 * BENT_M, 5e-3)
        distances.append(np.linalg.norm(body.tip()[0] - ball.center_m))
    assert min(distances) > 0.047
    assert distances[-1] > 0.0495
    assert min(distances) < 0.055


def test_an_arm_that_lies_on_something_begins_at_rest_on_it() -> None:
    body = MujocoBody(PAPER, nominal(PAPER), (HalfSpace((0.0, 0.0, 1.0), 0.2),))
    rested = body.tip()[0]
    assert rested[2] == pytest.approx(0.199, abs=1e-3)
    np.testing.assert_allclose(settle(body, np.zeros(3), 1.0)[0], rested, atol=1e-4)


def test_sections_do_not_touch_each_other() -> None:
    """Thick links overlap where they are joined: that is no contact."""
    trunk = replace(ARMS["trunk"], body_radius_m=0.05, keep_outs=(Sphere((9.0, 0.0, 0.0), 0.1),))
    thick, thin = nominal_body(trunk), nominal_body(ARMS["trunk"])
    lengthening_m = np.tile(BENT_M, 3)
    for body in (thick, thin):
        body.step(lengthening_m, 1.0)
    np.testing.assert_array_equal(thick.tip()[0], thin.tip()[0])


@pytest.mark.parametrize(
    ("gravity", "mode_hz", "stiffness"), [("standing", 0.6, 0.8), ("hanging", 2.2, 0.05)]
)
def test_an_arm_that_cannot_hold_itself_is_refused(
    gravity: str, mode_hz: float, stiffness: float
) -> None:
    values = replace(NOMINAL, lowest_mode_hz=mode_hz)
    with pytest.raises(InvalidInput, match="raise lowest_mode_hz"):
        MujocoBody(under(gravity), DrawnParameters(0, values, values, (stiffness,)))


def test_a_mode_that_no_stiffness_gives_is_refused() -> None:
    """A hanging arm never swings slower than the pendulum that it is."""
    values = replace(NOMINAL, lowest_mode_hz=0.05)
    with pytest.raises(InvalidInput, match=r"lowest_mode_hz = 0\.05"):
        MujocoBody(PAPER, DrawnParameters(0, values, values, (1.0,)))


def test_an_unstable_calculation_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And not gone on with from the start, nor told to a file, as MuJoCo itself would."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(HardwareError, match="unstable"):
        nominal_body(PAPER).step(np.array([1e9, 0.0, 0.0]), 0.1)
    assert not list(tmp_path.iterdir())

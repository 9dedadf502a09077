"""The limits: what is left of them is what it should be, and clip touches nothing else."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.actuation.pressure_map import PressureMap, length_bounds_m
from pneuarm.controllers.actuation.valve_lead import largest_rates_pa_s
from pneuarm.controllers.arm.arm import Arm, Array, HalfSpace, Response, Sphere
from pneuarm.controllers.geometry.compiled_function import CompiledFunction
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths
from pneuarm.controllers.limits.bend import BendLimit
from pneuarm.controllers.limits.keep_out import KeepOutLimit
from pneuarm.controllers.limits.length import LengthLimit
from pneuarm.controllers.limits.limit import Limit
from pneuarm.controllers.limits.limits import KINDS, Limits, names
from pneuarm.controllers.limits.pressure import PressureLimit
from tests.controllers.laws.driving import clearance_m
from tools.rig.arms import ARMS, random_lengths

DT_S = 0.005
SEEDS = st.integers(0, 2**32 - 1)


def bend_rad(arm: Arm, lengths: np.ndarray) -> np.ndarray:
    shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))
    return np.hypot(shapes[:, 1], shapes[:, 2])


def anywhere(arm: Arm, seed: int) -> np.ndarray:
    """Lengths from far below to far above their bounds."""
    rng = np.random.default_rng(seed)
    return arm.rest_lengths_m * rng.uniform(0.0, 2.0, (arm.n_sections, 3))


def keep_outs_arm(arm: Arm) -> Arm:
    """The arm with a ball beside it and a wall."""
    reach = arm.total_rest_length_m
    ball = Sphere((0.5 * reach, 0.0, 0.7 * reach), 0.15 * reach)
    wall = HalfSpace((0.0, -1.0, 0.0), 0.3 * reach)
    return replace(arm, keep_outs=(ball, wall), body_radius_m=0.02)


def evaluated(limit: Limit, arm: Arm, lengths: Array) -> Array:
    symbol = ca.SX.sym("lengths", arm.n_chambers)
    function = ca.Function("slack", [symbol], [limit.slack(symbol)])
    return np.array(function(lengths.reshape(-1))).reshape(-1)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@pytest.mark.parametrize("seed", range(20))
def test_the_slack_of_every_limit_is_what_is_left_of_it(arm: Arm, seed: int) -> None:
    lengths = random_lengths(arm, np.random.default_rng(seed))
    low, high = length_bounds_m(arm)
    expected = np.concatenate([(lengths - low).reshape(-1), (high - lengths).reshape(-1)])
    np.testing.assert_allclose(evaluated(LengthLimit(arm), arm, lengths), expected, atol=1e-15)
    left = arm.per_section("bend_max_rad")[:, 0] - bend_rad(arm, lengths)
    slack = left * arm.per_section("chamber_offset_m")[:, 0]
    np.testing.assert_allclose(evaluated(BendLimit(arm), arm, lengths), slack, atol=1e-12)
    np.testing.assert_allclose(BendLimit(arm).left_m(lengths), slack, atol=1e-12)
    pressures = PressureMap(arm).pressures_pa(lengths)
    bounds = [arm.per_chamber(name) for name in ("pressure_min_pa", "pressure_max_pa")]
    both = np.concatenate([pressures - bounds[0], bounds[1] - pressures]).reshape(-1)
    metres = np.tile(arm.per_chamber("lengthening_m_per_pa").reshape(-1), 2)
    found = evaluated(PressureLimit(arm), arm, lengths)
    np.testing.assert_allclose(found, metres * both, atol=1e-12)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@pytest.mark.parametrize("seed", range(20))
def test_the_clearance_is_never_more_than_the_truth_and_little_less(arm: Arm, seed: int) -> None:
    arm = keep_outs_arm(arm)
    lengths = random_lengths(arm, np.random.default_rng(seed))
    found = KeepOutLimit(arm).left_m(lengths).reshape(len(arm.keep_outs), arm.n_sections)
    for place, clearances in zip(arm.keep_outs, found, strict=True):
        truth = clearance_m(arm, lengths, place)
        assert truth - 2.5e-3 <= clearances.min() <= truth + 1e-6


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@given(seed=SEEDS)
def test_the_bend_clip_is_exact_and_touches_nothing_but_the_bend(arm: Arm, seed: int) -> None:
    lengths = anywhere(arm, seed)
    clipped = BendLimit(arm).clip(lengths)
    offset = arm.per_section("chamber_offset_m")
    before, after = shapes_from_lengths(lengths, offset), shapes_from_lengths(clipped, offset)
    allowed = np.minimum(bend_rad(arm, lengths), arm.per_section("bend_max_rad")[:, 0])
    np.testing.assert_allclose(bend_rad(arm, clipped), allowed, atol=1e-13)
    np.testing.assert_allclose(after[:, 0], before[:, 0], atol=1e-15)
    angles = [np.arctan2(shape[:, 2], shape[:, 1]) for shape in (before, after)]
    np.testing.assert_allclose(np.cos(angles[0] - angles[1]), 1.0, atol=1e-12)
    within = bend_rad(arm, lengths) <= arm.per_section("bend_max_rad")[:, 0]
    np.testing.assert_array_equal(clipped[within], lengths[within])


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@given(seed=SEEDS)
def test_unbending_keeps_the_length_bounds_that_held_before(arm: Arm, seed: int) -> None:
    limits = Limits(arm)
    low, high = length_bounds_m(arm)
    clipped = limits.clip(anywhere(arm, seed))
    assert (clipped >= low - 1e-15).all()
    assert (clipped <= high + 1e-15).all()
    assert (clipped > arm.per_chamber("length_min_m")).all()
    assert (clipped < arm.per_chamber("length_max_m")).all()
    assert (bend_rad(arm, clipped) <= arm.per_section("bend_max_rad")[:, 0] + 1e-12).all()
    np.testing.assert_allclose(limits.clip(clipped), clipped, atol=1e-15)


def test_every_limit_has_a_name_and_a_bit_of_its_own() -> None:
    assert {kind.bit: kind.name for kind in KINDS} == {
        1: "length",
        2: "bend",
        4: "pressure",
        8: "keep-out",
    }
    assert names(0) == ()
    assert set(names(2 | 8)) == {"bend", "keep-out"}


@cache
def slew_bench(lags_s: tuple[float, float]) -> tuple[Arm, CompiledFunction]:
    """An arm whose valves have these lags, and what a step of ``DT_S`` leaves of its slew."""
    arm = replace(
        ARMS["paper"], response=Response(filling_lag_s=lags_s[0], exhausting_lag_s=lags_s[1])
    )
    symbols = [ca.SX.sym("before", 3), ca.SX.sym("after", 3)]
    left = PressureLimit(arm).step_slack(*symbols, ca.SX(DT_S))
    return arm, CompiledFunction("left", symbols, [left])


@pytest.mark.parametrize("lags_s", [(0.4, 1.6), (0.06, 0.06)], ids=["slow", "quick"])
@given(seed=SEEDS)
def test_a_step_leaves_what_slew_and_valves_allow_in_its_direction(
    lags_s: tuple[float, float], seed: int
) -> None:
    arm, left = slew_bench(lags_s)
    slew = arm.per_chamber("pressure_slew_max_pa_s")
    rising, falling = (np.minimum(slew, rate) for rate in largest_rates_pa_s(arm.response))
    assert (bool((rising < slew).all()), bool((falling < slew).all())) == (lags_s[0] > 0.06,) * 2
    rng = np.random.default_rng(seed)
    before = random_lengths(arm, rng, 0.5)
    after = before + 10.0 ** rng.uniform(-5.0, -2.5) * rng.uniform(-1.0, 1.0, (1, 3))
    change = PressureMap(arm).pressures_pa(after) - PressureMap(arm).pressures_pa(before)
    allowed = np.where(change > 0.0, rising, falling) * DT_S
    slack = left(before, after)[0].reshape(1, 3)
    np.testing.assert_array_equal(slack >= 0.0, np.abs(change) <= allowed)
    metres = arm.per_chamber("lengthening_m_per_pa")
    left_pa = np.minimum(rising * DT_S - change, falling * DT_S + change)
    np.testing.assert_allclose(slack, metres * left_pa, atol=1e-12)

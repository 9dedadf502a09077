"""The safe step far from every limit: how fast it goes, by numbers that are reckoned otherwise."""

import casadi as ca
import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.kinematics.compiled import CompiledKinematics
from pneuarm.controllers.limits.length import LengthLimit
from pneuarm.controllers.limits.limit import Limit
from tests.controllers.laws.test_safe_step_walls import (
    ACCELERATION,
    ARM,
    CRUISE,
    DT_S,
    FASTER,
    RATE,
    SLOWER,
    START,
    Bench,
    free,
    wall,
)

#: Of the acceleration, what the way to the target is planned with.
BRAKING = 0.8 * ACCELERATION


class Slow(Limit):
    """Chamber 1 may go at 10 mm/s, to first order; exactly, at ``exact_m_s``."""

    name, bit, margin_m, convex = "slow", 1 << 22, 0.0, True
    exact_m_s = 1.0

    def slack(self, lengths: ca.SX) -> ca.SX:
        return ca.SX(1, 1) + 1.0

    def rate_share(self, lengths: ca.SX, rates: ca.SX) -> ca.SX:
        return ca.fabs(rates[0]) / 0.01

    def step_slack(self, before: ca.SX, after: ca.SX, dt: ca.SX) -> ca.SX:
        return dt * self.exact_m_s - ca.fabs(after[0] - before[0])


def bench_of(jacobian: Array | None = None, feedback: bool = False) -> Bench:
    """A bench with nothing in the way, whose task has a Jacobian (rows, 3)."""
    bench = Bench(LengthLimit(ARM))
    bench.problem.jacobian[...] = 0.0
    if jacobian is not None:
        bench.problem.jacobian.reshape(-1, 3)[: len(jacobian)] = jacobian
    bench.problem.checks.reshape(-1)[2] = float(feedback)
    return bench


def settled(bench: Bench, wish: Array) -> Array:
    """The rates (3,) that come of a wish in the end; the arm stays where it is."""
    bench.rates_m_s[:] = 0.0
    for _ in range(200):
        bench.step.take(wish)
        bench.rates_m_s[:] = bench.step.rates_m_s
    return bench.rates_m_s.copy()


@pytest.mark.parametrize("feedback", [True, False], ids=["error", "velocity"])
@pytest.mark.parametrize("speed_max_m_s", [10.0, 0.02])
@pytest.mark.parametrize("gain_per_s", [0.7, 5.0, 1000.0])
@pytest.mark.parametrize("size", [0.05, 0.6, 3.0])
def test_it_is_as_fast_as_rates_tip_speed_and_the_way_to_brake_allow(
    feedback: bool, speed_max_m_s: float, gain_per_s: float, size: float
) -> None:
    rng = np.random.default_rng(round(1000 * size))
    jacobian = rng.uniform(-1.0, 1.0, (3, 3))
    bench = bench_of(jacobian, feedback)
    bench.ask(gain_per_s, speed_max_m_s)
    wish = size * np.array([1.0, -0.6, 0.3])
    rates, wanted = settled(bench, wish), wish * RATE
    share = rates[0] / wanted[0]
    np.testing.assert_allclose(rates, share * wanted, rtol=1e-9)
    used = [share, np.abs(rates).max() / RATE]
    if feedback:
        used.append(np.linalg.norm(jacobian @ rates) / speed_max_m_s)
        left_m = np.abs(wanted) / min(gain_per_s, 1.0 / DT_S)
        way_m = np.abs(rates) * DT_S + rates**2 / (2.0 * BRAKING)
        used.append(float((way_m / left_m).max()))
    assert max(used) == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("seed", range(30))
def test_a_tick_changes_the_rates_toward_the_wish_without_turning_aside(seed: int) -> None:
    rng, bench = np.random.default_rng(seed), bench_of()
    bench.ask(1.0, 10.0)
    wanted = RATE * rng.uniform(-1.0, 1.0, 3)
    change = ACCELERATION * DT_S
    near = rng.uniform(0.0, 1.5) * wanted + change * rng.uniform(-1.5, 1.5, 3)
    before = np.clip(near, -RATE, RATE)
    bench.rates_m_s[:] = before
    bench.step.take(wanted / RATE)
    ends = np.sort([(before - change) / wanted, (before + change) / wanted], axis=0)
    low, high = ends[0].max(), ends[1].min()
    if low <= high:  # a share of the wanted rates is there within the tick
        share = max(min(high, 1.0), low)
    else:
        share = min(max(before @ wanted / (wanted @ wanted), 0.0), 1.0)
    expected = np.clip(share * wanted, before - change, before + change)
    expected = np.clip(expected, -RATE, RATE)
    np.testing.assert_allclose(bench.step.rates_m_s, expected, atol=1e-12)
    np.testing.assert_allclose(bench.step.moved_m, START + DT_S * expected, atol=1e-15)


@pytest.mark.parametrize("rates", [[0.1, -0.05, 0.02], [0.001, 0.0, -0.002], [0.0, 0.0, 0.0]])
def test_braking_slows_all_chambers_by_one_share(rates: list[float]) -> None:
    bench = bench_of()
    bench.rates_m_s[:] = rates
    bench.step.take(None)
    largest = max(np.abs(rates))
    share = max(0.0, 1.0 - ACCELERATION * DT_S / largest) if largest else 0.0
    np.testing.assert_allclose(bench.step.rates_m_s, share * np.array(rates), atol=1e-11)


def test_what_is_allowed_of_a_wish_is_found_to_a_32nd() -> None:
    fast, braked = free(FASTER)[1], free(None)[1]
    found = set()
    for part in np.linspace(0.1, 0.9, 9):
        rate = braked + part * (fast - braked)
        at_m = START[0] + DT_S * rate + rate**2 / (2.0 * ACCELERATION)
        now = Bench(wall(at_m + 1.0, 1.0)).take(FASTER)[1]
        share = 32.0 * (now - braked) / (fast - braked)
        assert share == pytest.approx(round(share), abs=1e-6)
        assert -1e-6 <= 32.0 * part - share <= 1.0 + 1e-6
        found.add(round(share) % 2)
    assert found == {0, 1}


def test_from_beyond_a_limit_it_comes_back_and_goes_no_deeper() -> None:
    for wish, moves in ((FASTER, True), (SLOWER, False)):
        bench = Bench(wall(START[0] - 0.001, 0.002))  # 1 mm too near, on its longer side
        bench.rates_m_s[:] = 0.0
        now, _ = bench.take(wish)
        assert bool(now > START[0]) is moves
        assert now >= START[0]


def test_at_a_limit_the_other_chambers_move_along_it() -> None:
    bench = Bench(wall(START[0] - 1.0, 1.0))
    bench.rates_m_s[:] = 0.0
    left = bench.step
    left.take(np.array([0.0, 1.0, -1.0]))
    np.testing.assert_allclose(left.rates_m_s, [0.0, 0.02, -0.02], atol=1e-12)


@pytest.mark.parametrize("room_m", [1e-3, 4e-4, 1e-4])
def test_a_curved_limit_keeps_half_of_its_margin_or_what_is_left_of_it(room_m: float) -> None:
    limit = wall(START[0] + 1.0 + room_m, 1.0)
    limit.margin_m = 1e-3
    bench = Bench(limit)
    bench.rates_m_s[:] = 0.0
    rates = []
    for _ in range(60):
        bench.take(FASTER)
        bench.lengths_m[:] = bench.step.moved_m
        bench.rates_m_s[:] = bench.step.rates_m_s
        rates.append(bench.rates_m_s[0])
    left_m = room_m - (bench.lengths_m[0] - START[0])
    assert left_m >= min(0.5e-3, room_m) - 1e-9
    assert bool(max(rates) > 1e-3) is (room_m > 0.5e-3)
    assert left_m < max(0.6e-3, room_m + 1e-9)


@pytest.mark.parametrize(("exact_m_s", "rate_m_s"), [(1.0, 0.01), (0.0061, 0.0059375)])
def test_what_a_limit_says_of_rates_slows_and_of_a_step_is_kept_exactly(
    exact_m_s: float, rate_m_s: float
) -> None:
    limit = Slow(ARM)
    limit.exact_m_s = exact_m_s
    bench = Bench(limit)
    bench.rates_m_s[:] = 0.0
    bench.step.take(np.array([0.5, 0.25, -0.5]))
    expected = rate_m_s * np.array([1.0, 0.5, -1.0])
    np.testing.assert_allclose(bench.step.rates_m_s, expected, atol=1e-9)


def test_the_tip_is_that_of_the_lengths_after_the_step() -> None:
    bench = bench_of()
    bench.step.take(np.array([1.0, -0.5, 0.2]))
    tip = CompiledKinematics(ARM).evaluate(bench.step.moved_m.reshape(1, 3))
    np.testing.assert_allclose(bench.step.tip.position_m, tip.position_m, atol=1e-14)
    np.testing.assert_allclose(bench.step.tip.rotation, tip.rotation, atol=1e-14)
    np.testing.assert_allclose(bench.step.tip.jacobian, tip.jacobian, atol=1e-12)


def test_a_wish_of_nothing_brakes_and_is_a_number() -> None:
    bench = bench_of()
    bench.ask(5.0, 0.0)  # no speed at all
    for rates in (CRUISE, np.zeros(3)):
        bench.rates_m_s[:] = rates
        bench.step.take(np.zeros(3))
        assert np.isfinite(bench.step.rates_m_s).all()
        assert (np.abs(bench.step.rates_m_s) <= np.abs(rates)).all()


def test_the_error_is_how_far_the_tip_is_from_its_target_after_the_step() -> None:
    bench = bench_of()
    bench.rates_m_s[:] = 0.0
    bench.step.take(np.zeros(3))
    assert isinstance(bench.step.error_m, float)
    assert bench.step.error_m == pytest.approx(0.0, abs=1e-12)
    bench.ask(5.0, 1.0, (0.0, 0.0, 0.25))
    bench.step.take(np.zeros(3))
    assert bench.step.error_m == pytest.approx(0.05)


def test_what_is_tried_leaves_the_rates_that_were_before() -> None:
    bench = Bench(wall(START[0] + 1.0 + 1e-6, 1.0))
    bench.take(FASTER)
    np.testing.assert_array_equal(bench.lengths_m, START)
    assert bench.rates_m_s[0] in (0.0, CRUISE[0])

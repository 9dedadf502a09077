"""The safe step against limits that are no convex sets, thinner than a step's way, or no number."""

from dataclasses import dataclass, field

import casadi as ca
import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.laws.safe_step import SafeStep
from pneuarm.controllers.laws.solve_ik import IkBuilder
from pneuarm.controllers.limits.length import LengthLimit
from pneuarm.controllers.limits.limit import Limit
from pneuarm.controllers.targets.targets import PARTS, PositionTarget
from pneuarm.controllers.tasks.wanted import Wanted
from tools.rig.arms import paper_arm

ARM = paper_arm()
DT_S = 0.005
RATE = float(ARM.per_chamber("length_rate_max_m_s")[0, 0])
ACCELERATION = float(ARM.per_chamber("length_acceleration_max_m_s2")[0, 0])
START = ARM.rest_lengths_m.reshape(-1)
#: All chambers together and half as fast as they may be.
CRUISE = np.full(3, 0.5 * RATE)
FASTER, SLOWER = np.ones(3), np.full(3, -1.0)


class Wall(Limit):
    """Chamber 1 keeps ``half_m`` away from a length; on either side of that it may be."""

    name, bit, margin_m = "wall", 1 << 20, 0.0
    at_m = half_m = 0.0

    def slack(self, lengths: ca.SX) -> ca.SX:
        return ca.fabs(lengths[0] - self.at_m) - self.half_m


class Cliff(Limit):
    """What is left of it is no number where chamber 1 is longer than ``at_m``."""

    name, bit, margin_m, convex = "cliff", 1 << 21, 0.0, True
    at_m = 0.0

    def slack(self, lengths: ca.SX) -> ca.SX:
        return 1.0 + ca.sqrt(self.at_m - lengths[0])


@dataclass
class Bench:
    """One step, and the arrays that it reads."""

    limit: Limit
    lengths_m: Array = field(default_factory=START.copy)
    rates_m_s: Array = field(default_factory=CRUISE.copy)

    def __post_init__(self) -> None:
        limits = (LengthLimit(ARM), self.limit)
        builder = IkBuilder(ARM, limits, False)
        self.problem = builder.problem
        self.wanted = Wanted(ARM.n_chambers, PARTS)
        self.ask(5.0, 1.0)
        self.step = SafeStep(ARM, limits, False, self.problem.rate.size)
        dt = np.full(1, DT_S)
        self.step.bind(self.lengths_m, self.rates_m_s, self.wanted.values, dt, self.problem)

    def ask(
        self,
        gain_per_s: float,
        speed_max_m_s: float,
        position_m: tuple[float, ...] = (0.0, 0.0, 0.2),
    ) -> None:
        """Ask for the tip at a position."""
        PositionTarget(np.array(position_m)).ask(self.wanted, gain_per_s, speed_max_m_s)

    def take(self, wish: Array | None) -> tuple[float, float]:
        """Return length and rate of chamber 1 after the step."""
        self.step.take(wish)
        return float(self.step.moved_m[0]), float(self.step.rates_m_s[0])


def stop_m(moved_m: float, rate_m_s: float) -> float:
    """Where chamber 1 comes to rest, as hard as the acceleration allows."""
    return moved_m + rate_m_s * abs(rate_m_s) / (2.0 * ACCELERATION)


def free(wish: Array | None) -> tuple[float, float]:
    """The step with nothing in its way."""
    return Bench(LengthLimit(ARM)).take(wish)


def wall(at_m: float, half_m: float) -> Wall:
    limit = Wall(ARM)
    limit.at_m, limit.half_m = at_m, half_m
    return limit


def test_a_wall_between_the_step_and_where_it_could_stop_is_seen() -> None:
    moved, rate = free(FASTER)
    stop, braked_stop = stop_m(moved, rate), stop_m(*free(None))
    middle = 0.5 * (moved + stop)
    half = 0.1 * (stop - moved)
    assert moved < middle - half, "the wall is beyond the step, and not where the arm could stop"
    assert braked_stop > middle + half or braked_stop < middle - half
    now, rate_now = Bench(wall(middle, half)).take(FASTER)
    assert (now, rate_now) != (moved, rate)
    assert abs(0.5 * (now + stop_m(now, rate_now)) - middle) >= half


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_no_part_of_the_way_to_the_stop_is_taken_for_granted(share: float) -> None:
    moved, rate = free(FASTER)
    stop = stop_m(moved, rate)
    at, half = moved + share * (stop - moved), 0.05 * (stop - moved)
    now, rate_now = Bench(wall(at, half)).take(FASTER)
    ends = [now, 0.5 * (now + stop_m(now, rate_now)), stop_m(now, rate_now)]
    assert min(abs(place - at) for place in ends) >= half - 1e-12
    assert (now, rate_now) != (moved, rate)


@pytest.mark.parametrize("wish", [FASTER, SLOWER, None], ids=["faster", "slower", "brake"])
def test_where_not_even_braking_is_allowed_it_stands_still_at_once(wish: Array | None) -> None:
    ahead = stop_m(START[0], CRUISE[0])
    # Wider than any way: every step with a rate left ends in it, and standing is outside.
    near = START[0] + 0.01 * (ahead - START[0])
    far = START[0] + 1.0
    bench = Bench(wall(0.5 * (near + far), 0.5 * (far - near)))
    now, rate = bench.take(wish)
    assert (now, rate) == (START[0], 0.0)
    np.testing.assert_array_equal(bench.step.moved_m, START)
    np.testing.assert_array_equal(bench.step.rates_m_s, 0.0)


def test_where_braking_is_allowed_it_does_not_stand_still_at_once() -> None:
    for wish in (FASTER, SLOWER, None):
        now, rate = free(wish)
        assert now > START[0]
        assert rate >= CRUISE[0] - ACCELERATION * DT_S - 1e-12


def test_what_is_left_of_a_limit_and_is_no_number_is_not_allowed() -> None:
    moved, rate = free(FASTER)
    braked = stop_m(*free(None))
    cliff = Cliff(ARM)
    cliff.at_m = 0.5 * (braked + stop_m(moved, rate))
    now, rate_now = Bench(cliff).take(FASTER)
    assert (now, rate_now) != (moved, rate)
    assert stop_m(now, rate_now) <= cliff.at_m
    assert rate_now > 0.0  # slowed down and not stopped: less of the wish is a number

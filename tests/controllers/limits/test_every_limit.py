"""What every limit promises: its margin, where it stops, how it is called, what it refuses."""

from dataclasses import replace
from math import inf, nextafter

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.actuation.pressure_map import PressureMap, length_bounds_m
from pneuarm.controllers.actuation.valve_lead import largest_rates_pa_s
from pneuarm.controllers.arm.arm import Arm, HalfSpace, Response, Section, Sphere
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.geometry.compiled_function import CompiledFunction
from pneuarm.controllers.kinematics.constant_curvature import (
    section_end_transforms,
    section_transforms,
    shapes_from_lengths,
)
from pneuarm.controllers.limits.bend import BendLimit
from pneuarm.controllers.limits.keep_out import KeepOutLimit
from pneuarm.controllers.limits.length import LengthLimit
from pneuarm.controllers.limits.limit import Limit
from pneuarm.controllers.limits.limits import (
    KINDS,
    Limits,
    names,
    refuse_contradictions,
    words,
    workspace_is_exact,
)
from pneuarm.controllers.limits.pressure import PressureLimit
from tools.rig.arms import ARMS, PAPER_SECTION, paper_arm, random_lengths, trunk_arm

#: Filling and exhausting, as slow valves do: neither of them as fast as the slew limit allows.
SLOW = Response(filling_lag_s=0.4, exhausting_lag_s=1.6)
MARGINS_M = {LengthLimit: 1e-7, PressureLimit: 1e-7, BendLimit: 2e-6, KeepOutLimit: 1e-4}
each_kind = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)


class Plain(Limit):
    """What is left of it is the lengths themselves, less an offset."""

    name, bit, margin_m = "plain", 1 << 20, 0.25
    offset_m = 0.0

    def slack(self, lengths: ca.SX) -> ca.SX:
        return lengths - self.offset_m


def kept_out(arm: Arm) -> Arm:
    ball = Sphere((0.3, 0.05, 0.1), 0.05)
    return replace(arm, keep_outs=(ball, HalfSpace((0.0, 1.0, 0.0), 0.5)), body_radius_m=0.02)


def unequal() -> Arm:
    """Three sections, each with another bound of the bend."""
    arm = trunk_arm()
    bends = (0.5, 1.0, 1.5)
    pairs = zip(arm.sections, bends, strict=True)
    return replace(arm, sections=tuple(replace(one, bend_max_rad=bend) for one, bend in pairs))


def with_section(**changed: float) -> Section:
    return replace(PAPER_SECTION, **changed)  # type: ignore[arg-type]


def value(expression: ca.SX) -> float:
    return float(ca.DM(expression))


# --- what a law is told -------------------------------------------------------------------------


@each_kind
def test_a_step_may_use_a_share_of_what_is_beyond_the_margin(kind: type[Limit]) -> None:
    limit, margin = kind(kept_out(paper_arm())), MARGINS_M[kind]
    for slack, share in ((1e-2, 0.1), (1e-3, 0.5), (1e-3, 1.0)):
        left = value(limit.approach(ca.SX(slack), ca.SX(share)))
        assert left == pytest.approx(share * (slack - margin), rel=1e-12)
    lacking = value(limit.approach(ca.SX(0.0), ca.SX(0.1)))
    at_once = kind is PressureLimit  # a vented chamber need not creep along its bound
    assert lacking == pytest.approx(-margin if at_once else -0.1 * margin, rel=1e-12)
    beyond = value(limit.approach(ca.SX(-1e-3), ca.SX(0.1)))
    assert beyond == pytest.approx(-0.1 * (1e-3 + margin), rel=1e-12)
    barely = value(limit.approach(ca.SX(-0.5 * margin), ca.SX(0.1)))
    assert barely == pytest.approx(-margin if at_once else -0.15 * margin, rel=1e-12)


def test_what_the_laws_take_for_granted_of_a_kind() -> None:
    assert {kind for kind in KINDS if kind.convex} == {LengthLimit, BendLimit}
    assert {kind for kind in KINDS if kind.two_sided} == {LengthLimit, PressureLimit}
    assert {kind for kind in KINDS if kind.in_workspace} == {*KINDS} - {KeepOutLimit}
    assert (Plain.convex, Plain.two_sided, Plain.in_workspace) == (False,) * 3


@each_kind
def test_only_pressures_ask_about_the_way_and_not_the_place(kind: type[Limit]) -> None:
    arm = kept_out(trunk_arm())
    limit, lengths, after = kind(arm), ca.SX.sym("lengths", 9), ca.SX.sym("after", 9)
    asked = kind is PressureLimit
    assert limit.rate_share(lengths, after).shape == (1 if asked else 0, 1)
    assert limit.step_slack(lengths, after, ca.SX(0.1)).shape == (9 if asked else 0, 1)


@given(seed=st.integers(0, 2**32 - 1))
@pytest.mark.parametrize("name", ["paper", "trunk"])
def test_the_share_of_the_slew_is_that_of_the_chamber_that_uses_most(name: str, seed: int) -> None:
    arm, share = _rate_share(name)
    rng = np.random.default_rng(seed)
    lengths = random_lengths(arm, rng, 0.5)
    rates = rng.uniform(-0.01, 0.01, lengths.shape)
    model, small = PressureMap(arm), 1e-6
    ends = [model.pressures_pa(lengths + sign * small * rates) for sign in (1.0, -1.0)]
    change = (ends[0] - ends[1]) / (2.0 * small)
    rising, falling = largest_rates_pa_s(arm.response)
    used = float(np.where(change > 0.0, change / rising, -change / falling).max())
    # To first order, so a little less than everything may be used.
    assert 1.001 * used <= float(share(lengths, rates)[0][0]) <= 1.005 * used


_SHARES: dict[str, tuple[Arm, CompiledFunction]] = {}


def _rate_share(name: str) -> tuple[Arm, CompiledFunction]:
    if name not in _SHARES:
        arm = replace(ARMS[name], response=SLOW)
        symbols = [ca.SX.sym(symbol, arm.n_chambers) for symbol in ("lengths", "rates")]
        share = PressureLimit(arm).rate_share(*symbols)
        _SHARES[name] = arm, CompiledFunction("share", symbols, [share])
    return _SHARES[name]


@each_kind
def test_what_is_left_is_the_slack(kind: type[Limit]) -> None:
    arm = kept_out(trunk_arm())
    limit, lengths = kind(arm), random_lengths(arm, np.random.default_rng(3), 0.5)
    symbol = ca.SX.sym("lengths", 9)
    slack = ca.Function("slack", [symbol], [limit.slack(symbol)])(lengths.reshape(-1))
    np.testing.assert_allclose(limit.left_m(lengths), np.array(slack).ravel(), atol=1e-15)


def test_the_bend_of_a_straight_arm_has_all_of_its_slack_and_a_slope() -> None:
    arm = paper_arm()
    symbol = ca.SX.sym("lengths", 3)
    slack = BendLimit(arm).slack(symbol)
    function = ca.Function("slack", [symbol], [slack, ca.jacobian(slack, symbol)])
    left, slope = (np.array(result) for result in function(arm.rest_lengths_m.reshape(-1)))
    assert left == pytest.approx(2.5 * 0.038, abs=1e-11)
    np.testing.assert_allclose(slope, 0.0, atol=1e-12)


# --- clipping -----------------------------------------------------------------------------------


@pytest.mark.parametrize("beyond", [5e-12, 1e-9, 0.5])
def test_a_bend_is_clipped_however_little_it_is_beyond_its_bound(beyond: float) -> None:
    arm, rng = unequal(), np.random.default_rng(0)
    bound, offset = arm.per_section("bend_max_rad")[:, 0], arm.per_section("chamber_offset_m")
    for section in range(3):
        lengths = arm.rest_lengths_m.copy()  # the others are straight
        tilt = rng.uniform(-1e-2, 1e-2, 3)
        lengths[section] += tilt - tilt.mean()
        shape = shapes_from_lengths(lengths, offset)[section]
        share = bound[section] * (1.0 + beyond) / np.hypot(shape[1], shape[2])
        lengths[section] += (share - 1.0) * (tilt - tilt.mean())
        clipped = BendLimit(arm).clip(lengths)
        shapes = shapes_from_lengths(clipped, offset)
        bends = np.hypot(shapes[:, 1], shapes[:, 2])
        assert bends[section] == pytest.approx(bound[section], rel=5e-13)
        others = np.arange(3) != section
        np.testing.assert_array_equal(clipped[others], lengths[others])


def test_a_length_is_clipped_to_the_bound_that_it_is_beyond_and_else_left() -> None:
    low, high = (float(bound[0, 0]) for bound in length_bounds_m(paper_arm()))
    clipped = LengthLimit(paper_arm()).clip(np.array([[0.0, 0.21, 0.9]]))
    np.testing.assert_array_equal(clipped, [[low, 0.21, high]])


# --- where a limit stops the arm ----------------------------------------------------------------


@each_kind
def test_it_stops_where_one_place_has_less_left_than_its_bound(kind: type[Limit]) -> None:
    arm = kept_out(paper_arm())
    limit, lengths = kind(arm), np.array([[0.19, 0.2, 0.215]])
    left = float(limit.left_m(lengths).min())
    for at_bound_m, stops in ((left, False), (nextafter(left, inf), True)):
        limit.at_bound_m = at_bound_m  # type: ignore[misc]
        assert limit.stops(lengths) is stops


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_length_stops_at_both_ends_of_eq_4_and_not_at_those_of_its_pressure(sign: float) -> None:
    limit = LengthLimit(paper_arm())
    shortest, longest = paper_arm().length_interval_m
    end = (longest if sign > 0.0 else shortest)[0, 0]
    for inside_m, stops in ((1.5e-5, True), (2.5e-5, False)):
        lengths = np.array([[0.2, end - sign * inside_m, 0.2]])
        assert limit.stops(lengths) is stops
    weak = replace(paper_arm(), sections=(with_section(pressure_max_pa=3e4),))
    limit = LengthLimit(weak)
    assert not limit.stops(limit.clip(np.full((1, 3), 0.29)))


def test_by_default_it_stops_20_micrometres_before_it() -> None:
    plain = Plain(paper_arm())
    assert not plain.stops(np.array([[2e-5, 0.1, 0.1]]))
    assert plain.stops(np.array([[0.1, 1.99e-5, 0.1]]))
    assert KeepOutLimit.at_bound_m == pytest.approx(2e-4)  # it has a larger margin


def test_the_bits_of_the_limits_that_bind_are_added() -> None:
    limits, arm = Limits(kept_out(paper_arm())), paper_arm()
    assert limits.binding(arm.rest_lengths_m) == 0
    assert [limit.bit for limit in limits] == [limit.bit for limit in limits] == [1, 4, 2, 8]
    assert [limit.bit for limit in Limits(arm)] == [1, 4, 2]
    assert limits.binding(limits.clip(np.array([[0.0, 0.2, 0.2]]))) & 1
    bent = BendLimit(arm).clip(np.array([[0.08, 0.25, 0.25]]))
    assert limits.binding(bent) & 2


def test_limits_are_named_for_people() -> None:
    assert words(0) == ""
    assert "length" in words(1)
    assert "Eq. (4)" in words(1)
    assert (words(2), words(4)) == ("bend", "pressure")
    assert set(words(2 | 8).split(" and ")) == {"bend", "keep-out"}
    assert names(1) == ("length",)


def test_the_workspace_is_exact_for_one_section_without_tool_and_keep_out() -> None:
    assert workspace_is_exact(paper_arm())
    assert not workspace_is_exact(kept_out(paper_arm()))
    assert not workspace_is_exact(replace(paper_arm(), tool_m=(0.0, 0.0, 0.1)))
    assert not workspace_is_exact(trunk_arm())
    assert not workspace_is_exact(replace(kept_out(trunk_arm()), tool_m=(0.0, 0.1, 0.0)))


# --- limits that exclude each other, or the arm at rest -----------------------------------------


def test_an_arm_that_rests_on_a_limit_is_within_and_one_beyond_it_is_told() -> None:
    plain = Plain(paper_arm())
    plain.offset_m = 0.2
    assert plain.contradiction() == ""
    plain = Plain(replace(paper_arm(), sections=(with_section(rest_length_m=0.19),)))
    plain.offset_m = 0.2
    assert all(fact in plain.contradiction() for fact in ("plain", "by 10 mm"))
    two = (with_section(rest_length_m=0.21), with_section(rest_length_m=0.19))
    plain = Plain(replace(paper_arm(), sections=two))
    plain.offset_m = 0.2
    assert "by 10 mm" in plain.contradiction()


@pytest.mark.parametrize("arm", [*ARMS.values(), kept_out(paper_arm())], ids=lambda arm: arm.name)
def test_the_arms_of_the_house_contradict_nothing(arm: Arm) -> None:
    assert [limit.contradiction() for limit in Limits(arm)] == [""] * len(list(Limits(arm)))
    refuse_contradictions(arm)


def test_bounds_that_leave_no_length_are_refused_with_chamber_and_bounds() -> None:
    narrow = with_section(length_min_m=0.2 - 1e-7, length_max_m=0.2 + 1e-7)
    arm = replace(paper_arm(), sections=(PAPER_SECTION, narrow))
    with pytest.raises(InvalidInput) as refused:
        refuse_contradictions(arm)
    facts = ("section 2", "chamber 1", "200 and 200 mm")
    assert [fact for fact in facts if fact not in str(refused.value)] == []


def test_bounds_that_leave_one_length_alone_leave_none() -> None:
    limit = LengthLimit(paper_arm())
    limit._lower_m = limit._upper_m
    assert "section 1, chamber 1" in limit.contradiction()


def test_a_keep_out_around_the_arm_at_rest_is_refused_with_its_place_and_section() -> None:
    arm = trunk_arm()
    far = Sphere((1.0, 0.0, 0.0), 0.1)
    upper = Sphere((0.0, 0.025, 0.225), 0.02)  # beside section 2, 25 mm off the axis
    for radius_m, told in ((0.004, False), (0.0051, True)):
        placed = replace(arm, keep_outs=(far, upper), body_radius_m=radius_m)
        limit = KeepOutLimit(placed)
        assert bool(limit.contradiction()) is told
    assert all(fact in limit.contradiction() for fact in ("keep_outs[1]", "section 2", "0.1 mm"))
    with pytest.raises(InvalidInput, match=r"keep_outs\[1\]"):
        refuse_contradictions(placed)
    touching = replace(arm, keep_outs=(upper,), body_radius_m=0.0)
    left_m = float(KeepOutLimit(touching).left_m(arm.rest_lengths_m).min())
    assert not KeepOutLimit(replace(touching, body_radius_m=left_m)).contradiction()


def test_a_keep_out_around_the_backbone_has_a_slope_too() -> None:
    """At a straight arm, and with its middle on a chord, nothing is divided by zero."""
    arm = replace(paper_arm(), keep_outs=(Sphere((0.0, 0.0, 0.1), 0.03),), body_radius_m=0.01)
    symbol = ca.SX.sym("lengths", 3)
    slack = KeepOutLimit(arm).slack(symbol)
    function = ca.Function("slack", [symbol], [slack, ca.jacobian(slack, symbol)])
    left, slope = (np.array(result) for result in function(arm.rest_lengths_m.reshape(-1)))
    assert left == pytest.approx(-0.04, abs=1e-9)
    assert np.isfinite(slope).all()


def test_without_a_keep_out_nothing_is_left_of_none() -> None:
    limit = KeepOutLimit(paper_arm())
    assert limit.slack(ca.SX.sym("lengths", 3)).shape == (0, 1)
    assert not limit.stops(paper_arm().rest_lengths_m)


@pytest.mark.parametrize("seed", range(3))
def test_a_keep_out_sees_ten_chords_a_section_less_what_the_arc_stands_off(seed: int) -> None:
    arm = kept_out(unequal())
    lengths = random_lengths(arm, np.random.default_rng(seed), 0.5)
    shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))
    left = KeepOutLimit(arm).left_m(lengths).reshape(2, 3)
    wall, start = np.array([0.0, 1.0, 0.0]), np.eye(4)
    for index, end in enumerate(section_end_transforms(arm, lengths)):
        parts = section_transforms(np.linspace(0.0, 1.0, 11)[:, None] * shapes[index])
        points = (start @ parts)[:, :3, 3]
        length, u, v = shapes[index]
        standoff = length * np.hypot(u, v) / 800.0
        distance = float((0.5 - points @ wall).min())
        assert left[1, index] == pytest.approx(distance - standoff - 0.02, abs=1e-12)
        fine = np.linspace(0.0, 1.0, 2001)[:, None, None]
        chords = points[:-1] + fine * (points[1:] - points[:-1])
        distance = float(np.linalg.norm(chords - [0.3, 0.05, 0.1], axis=2).min()) - 0.05
        assert left[0, index] == pytest.approx(distance - standoff - 0.02, abs=1e-7)
        start = end

"""The simulated valves and chambers, each property of the design by itself."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Array
from pneuarm.hardware.simulator.parameters import SimulatorParameters, draw
from pneuarm.hardware.simulator.pneumatics import Chamber, Play, Valve
from tests.hardware.simulator.test_simulator import PAPER

NOMINAL = SimulatorParameters()
RANGE_PA = 1.8e5
VALVE_HALF_LOOP_PA = 0.5 * 0.01 * RANGE_PA
SETTLED_S = 2.0


def pressures(value_pa: float) -> Array:
    """Return the same pressure in every chamber of the paper's arm."""
    return np.full((1, 3), value_pa)


def settled_pa(valve: Valve, value_pa: float, from_s: float) -> float:
    """Command, wait until nothing moves any more, and tell the pressure."""
    valve.command(pressures(value_pa), from_s)
    valve.advance(from_s, from_s + SETTLED_S)
    return float(valve.pressures_pa[0, 0])


def test_valve_waits_for_its_delay() -> None:
    """Nothing moves within 5 ms of a command, and something right after."""
    valve = Valve(PAPER, NOMINAL)
    valve.command(pressures(5e4), 0.0)
    valve.advance(0.0, 0.005 - 1e-6)
    assert np.array_equal(valve.pressures_pa, pressures(0.0))
    valve.advance(0.005 - 1e-6, 0.006)
    assert (valve.pressures_pa > 500.0).all()


def test_valve_has_covered_63_percent_after_delay_and_time_constant() -> None:
    """The first-order lag of 60 ms, towards the setpoint less half the loop."""
    valve = Valve(PAPER, NOMINAL)
    valve.command(pressures(5e4), 0.0)
    valve.advance(0.0, 0.065)
    expected_pa = (1.0 - np.exp(-1.0)) * (5e4 - VALVE_HALF_LOOP_PA)
    np.testing.assert_allclose(valve.pressures_pa, expected_pa, rtol=1e-9)


@given(cuts=st.lists(st.floats(0.0, 0.1), max_size=8))
def test_valve_follows_alike_however_the_time_is_cut(cuts: list[float]) -> None:
    """The discretisation is exact: two commands, any steps, the same pressure."""
    whole, cut = Valve(PAPER, NOMINAL), Valve(PAPER, NOMINAL)
    for valve in (whole, cut):
        valve.command(pressures(5e4), 0.0)
        valve.command(pressures(-3e4), 0.03)
    whole.advance(0.0, 0.1)
    times = [0.0, *sorted(cuts), 0.1]
    for start_s, end_s in pairwise(times):
        cut.advance(start_s, end_s)
    np.testing.assert_allclose(cut.pressures_pa, whole.pressures_pa, rtol=1e-9)


def test_valve_regulates_in_steps_of_its_resolution() -> None:
    """On the way up every settled pressure is a multiple of 5 mbar, less half the loop."""
    valve = Valve(PAPER, NOMINAL)
    settled = [settled_pa(valve, value, k * 3.0) for k, value in enumerate(np.arange(2e4, 3e4, 90))]
    steps = (np.array(settled) + VALVE_HALF_LOOP_PA) / 500.0
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-6)
    assert len(np.unique(np.rint(steps))) == pytest.approx(20, abs=2)


def test_valve_hysteresis_is_one_percent_of_the_range() -> None:
    """The same setpoint from below and from above differs by 18 mbar."""
    valve = Valve(PAPER, NOMINAL)
    from_below = settled_pa(valve, 3e4, 0.0)
    settled_pa(valve, 8e4, 3.0)
    from_above = settled_pa(valve, 3e4, 6.0)
    assert from_above - from_below == pytest.approx(0.01 * RANGE_PA, rel=1e-6)


def test_vent_ends_at_zero_where_a_command_of_zero_does_not() -> None:
    """Venting lifts the seat: the hysteresis keeps nothing back."""
    valve = Valve(PAPER, NOMINAL)
    settled_pa(valve, 8e4, 0.0)
    assert settled_pa(valve, 0.0, 3.0) == pytest.approx(VALVE_HALF_LOOP_PA)
    valve.vent(6.0)
    valve.advance(6.0, 8.0)
    np.testing.assert_allclose(valve.pressures_pa, 0.0, atol=1e-6)


def test_the_valves_of_a_seed_are_what_they_were_before_there_were_others() -> None:
    """Drawn values and pressures, recorded when `servo` was all there was."""
    values = draw(NOMINAL, 5, 1).values
    assert values.valve_time_constant_s == 0.05720085313885244
    assert values.valve_delay_s == 0.004816946410839997
    assert values.valve_resolution_pa == 409.05503878048904
    assert values.valve_hysteresis_fraction == 0.008195030842908672
    assert draw(NOMINAL, 5, 1).stiffness_factors == (1.189674477303702,)
    valve, now_s, found = Valve(PAPER, values), 0.0, []
    for wanted in ([5e4, -3e4, 1e4], [-2e4, 6e4, 1.2e4], None, [8.9e4, -8.9e4, 0.0]):
        if wanted is None:
            valve.vent(now_s)
        else:
            valve.command(np.array([wanted]), now_s)
        for step_s in (0.0021, 0.0173, 0.06):
            valve.advance(now_s, now_s + step_s)
            now_s += step_s
        found.append(valve.pressures_pa[0])
    recorded = [
        [35819.438136513854, -21217.131788280843, 6614.825440047827],
        [-4048.1983833128124, 37336.296103837856, 9954.670008807485],
        [-1433.523754172299, 10619.53237974171, 2728.1185802695395],
        [64070.300759568825, -61777.92130743319, 680.8052584439715],
    ]
    # Another machine's exp may differ in its last bit.
    np.testing.assert_allclose(found, recorded, rtol=1e-14)


def test_vent_overrules_what_was_written_before() -> None:
    """A command still on its way when the vent comes does not survive it."""
    valve = Valve(PAPER, NOMINAL)
    valve.command(pressures(8e4), 0.0)
    valve.vent(0.001)
    valve.advance(0.0, SETTLED_S)
    np.testing.assert_allclose(valve.pressures_pa, 0.0, atol=1e-6)


@given(inputs=st.lists(st.floats(-1e5, 1e5), min_size=1, max_size=20))
def test_play_stays_within_its_width_and_moves_no_more_than_it_must(inputs: list[float]) -> None:
    """The two axioms of the play operator."""
    play, half = Play(np.array([1e3])), 1e3
    before = 0.0
    for value in inputs:
        after = float(play.follow(np.array([value]))[0])
        assert abs(after - value) <= half * (1.0 + 1e-9)
        assert after == before or abs(after - value) == pytest.approx(half)
        before = after


def prompt_m(chamber: Chamber, value_pa: float) -> float:
    """Lengthening right after a pressure, before any creep."""
    chamber.advance(pressures(value_pa), 0.0)
    return float(chamber.lengthening_m[0, 0])


def test_chamber_hysteresis_is_three_percent_of_the_range() -> None:
    """The same pressure from below and from above: lengths apart by the map of 54 mbar."""
    chamber = Chamber(PAPER, NOMINAL)
    from_below = prompt_m(chamber, 3e4)
    prompt_m(chamber, 9e4)
    from_above = prompt_m(chamber, 3e4)
    assert from_above - from_below == pytest.approx(0.03 * RANGE_PA * 1.13e-6, rel=1e-9)


def test_chamber_creeps_by_three_percent_with_ten_seconds() -> None:
    """Prompt at once, 63 % of the extra after the time constant, all of it in the end."""
    chamber = Chamber(PAPER, NOMINAL)
    prompt = prompt_m(chamber, 5e4)
    assert prompt == pytest.approx(1.13e-6 * (5e4 - 0.5 * 0.03 * RANGE_PA), rel=1e-9)
    for share, duration_s in ((1.0 - np.exp(-1.0), 10.0), (1.0, 200.0)):
        chamber.advance(pressures(5e4), duration_s)
        extra = float(chamber.lengthening_m[0, 0]) / prompt - 1.0
        assert extra == pytest.approx(0.03 * share, rel=1e-6)

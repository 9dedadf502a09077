"""Valves through which air flows: the orifice's law, its regulator, and the logs they follow."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.hardware.simulator.adapter import SimulatedArm
from pneuarm.hardware.simulator.flow_valves import AMBIENT_PA, flowed_pa, valve_of
from pneuarm.hardware.simulator.parameters import (
    NOMINAL,
    FlowParameters,
    SwitchingParameters,
    Valves,
    draw,
)
from pneuarm.hardware.simulator.pneumatics import Valve
from tests.hardware.simulator.test_simulator import PAPER, session

PSI_PA = 6894.757
STEP_S = 2.5e-3
#: The arm of the logs: no vacuum, and commands up to 25 psi.
LOGGED = replace(
    PAPER, sections=(replace(PAPER.sections[0], pressure_min_pa=0.0, pressure_max_pa=25 * PSI_PA),)
)
FLOWING: tuple[Valves, ...] = ("itv", "onoff")
each_flowing = pytest.mark.parametrize("name", FLOWING)

seeds = st.integers(0, 1000)
arms = st.sampled_from([PAPER, LOGGED])
shares = st.floats(0.0, 1.0)


def made(name: Valves, arm: Arm = PAPER, seed: int | None = None) -> Valve:
    """Valves of a seed, or the nominal ones."""
    nominal = NOMINAL[name]
    return valve_of(arm, nominal if seed is None else draw(nominal, seed, arm.n_sections).values)


def parameters(name: Valves, seed: int) -> FlowParameters:
    values = draw(NOMINAL[name], seed, 1).values
    assert isinstance(values, FlowParameters)
    return values


def everywhere(value_pa: float) -> Array:
    return np.full((1, 3), value_pa)


def inside(arm: Arm, share: float) -> float:
    """Pressure at a share of the arm's range."""
    low_pa, high_pa = arm.sections[0].pressure_min_pa, arm.sections[0].pressure_max_pa
    return low_pa + share * (high_pa - low_pa)


def advanced_pa(valve: Valve, from_s: float, to_s: float) -> Array:
    """Pressures of the first chamber after each step on the way."""
    times = np.linspace(from_s, to_s, round((to_s - from_s) / STEP_S) + 1)
    found = []
    for start_s, end_s in pairwise(times.tolist()):
        valve.advance(start_s, end_s)
        found.append(float(valve.pressures_pa[0, 0]))
    return np.array(found)


def stepped_pa(valve: Valve, *values_pa: float, seconds: float = 15.0) -> Array:
    """Command one value after the other; the pressures on the way to the last."""
    for number, value_pa in enumerate(values_pa):
        valve.command(everywhere(value_pa), number * seconds)
        found = advanced_pa(valve, number * seconds, (number + 1) * seconds)
    return found


@given(pressure_pa=st.floats(1e4, 5e5), source_pa=st.floats(1e4, 5e5), ratio=st.floats(0.1, 0.6))
def test_air_flows_towards_its_source_and_no_further(
    pressure_pa: float, source_pa: float, ratio: float
) -> None:
    """However long the orifice is open."""
    low_pa, high_pa = sorted((pressure_pa, source_pa))
    before_pa = pressure_pa
    for exchange in (1e-3, 1e-2, 1.0):
        after_pa = flowed_pa(pressure_pa, source_pa, exchange, ratio)
        assert low_pa <= after_pa <= high_pa
        assert abs(after_pa - source_pa) <= abs(before_pa - source_pa)
        before_pa = after_pa
    assert flowed_pa(source_pa, source_pa, 1.0, ratio) == source_pa


@given(share=st.floats(0.01, 0.99), ratio=st.floats(0.1, 0.6))
def test_choked_flow_depends_on_the_higher_pressure_alone(share: float, ratio: float) -> None:
    """So a chamber fills at a constant rate, and empties exponentially, as ISO 6358 has it."""
    supply_pa, exchange = 5e5, 1e-4
    filling_pa = flowed_pa(share * ratio * supply_pa, supply_pa, exchange, ratio)
    assert filling_pa - share * ratio * supply_pa == pytest.approx(exchange * supply_pa)
    emptying_pa = flowed_pa(1e5 / (share * ratio), 1e5, exchange, ratio)
    assert emptying_pa == pytest.approx((1.0 - exchange) * 1e5 / (share * ratio))


@given(ratio=st.floats(0.1, 0.6), beyond=st.floats(0.001, 0.999))
def test_flow_that_is_not_choked_is_less_and_follows_the_ellipse(
    ratio: float, beyond: float
) -> None:
    """``beyond`` is how far the pressures' ratio is on its way from the critical one to 1."""
    source_pa, exchange = 3e5, 1e-6
    pressure_pa = source_pa * (ratio + beyond * (1.0 - ratio))
    passed_pa = flowed_pa(pressure_pa, source_pa, exchange, ratio) - pressure_pa
    assert (passed_pa / (exchange * source_pa)) ** 2 + beyond**2 == pytest.approx(1.0, abs=1e-3)


@each_flowing
@settings(max_examples=25)
@given(
    seed=seeds,
    arm=arms,
    asked=st.lists(st.tuples(st.one_of(st.none(), shares), st.floats(0.0, 1.0)), max_size=8),
)
def test_the_pressure_stays_between_what_it_exhausts_to_and_the_supply(
    name: Valves, seed: int, arm: Arm, asked: list[tuple[float | None, float]]
) -> None:
    """Whatever is commanded or vented, and when."""
    valve, section = made(name, arm, seed), arm.sections[0]
    supply_pa = section.pressure_max_pa + parameters(name, seed).valve_supply_margin_pa
    lowest_pa = 0.5 * (section.pressure_min_pa - AMBIENT_PA) if section.pressure_min_pa < 0 else 0.0
    now_s = 0.0
    for share, seconds in asked:
        if share is None:
            valve.vent(now_s)
        else:
            valve.command(everywhere(inside(arm, share)), now_s)
        found_pa = advanced_pa(valve, now_s, now_s + seconds)
        now_s += seconds
        assert (found_pa >= lowest_pa - 1e-6).all()
        assert (found_pa <= supply_pa + 1e-6).all()


@each_flowing
@settings(max_examples=15)
@given(seed=seeds, arm=arms, start=st.floats(0.1, 1.0), end=st.floats(0.1, 1.0))
def test_a_step_is_answered_without_turning_round_and_ends_at_its_setpoint(
    name: Valves, seed: int, arm: Arm, start: float, end: float
) -> None:
    """To half the resolution and half the hysteresis; on no seed does a valve overshoot.

    Not the last tenth of a range with vacuum: thin air goes out slowly.
    """
    values, section = parameters(name, seed), arm.sections[0]
    valve, goal_pa = made(name, arm, seed), inside(arm, end)
    stepped_pa(valve, inside(arm, start))
    valve.command(everywhere(goal_pa), 15.0)
    answer_pa = advanced_pa(valve, 15.0, 30.0)
    moved_pa = np.diff(answer_pa)
    # What was left of the way to the start is less than 0.1 Pa a step.
    assert (moved_pa >= -0.1).all() or (moved_pa <= 0.1).all()
    half_loop_pa = 0.5 * (section.pressure_max_pa - section.pressure_min_pa)
    half_loop_pa *= values.valve_hysteresis_fraction
    assert abs(answer_pa[-1] - goal_pa) <= 0.5 * values.valve_resolution_pa + half_loop_pa + 1.0


@each_flowing
@settings(max_examples=25)
@given(seed=seeds, arm=arms, state_pa=st.floats(-9.5e4, 3e5), share=shares)
def test_a_vent_ends_at_ambient_from_any_state(
    name: Valves, seed: int, arm: Arm, state_pa: float, share: float
) -> None:
    """Also from pressures that only a broken valve can have let in, with a command under way."""
    valve = made(name, arm, seed)
    valve.pressures_pa = everywhere(state_pa)
    valve.command(everywhere(inside(arm, share)), 0.0)
    valve.vent(0.001)
    advanced_pa(valve, 0.0, 10.0)
    np.testing.assert_allclose(valve.pressures_pa, 0.0, atol=1e-6)


@each_flowing
@settings(max_examples=25)
@given(seed=seeds, cuts=st.lists(st.floats(0.0, 1.2), max_size=20))
def test_it_matters_little_how_the_time_is_cut(name: Valves, seed: int, cuts: list[float]) -> None:
    """Two commands and a vent, with the longest steps allowed and with others in between."""
    whole, cut = made(name, seed=seed), made(name, seed=seed)
    for valve in (whole, cut):
        valve.command(everywhere(6e4), 0.0)
        valve.command(everywhere(-3e4), 0.4)
        valve.vent(1.0)
    even = np.linspace(0.0, 1.2, round(1.2 / STEP_S) + 1).tolist()
    for start_s, end_s in pairwise(even):
        whole.advance(start_s, end_s)
    for start_s, end_s in pairwise(sorted([*even, *cuts])):
        cut.advance(start_s, end_s)
    np.testing.assert_allclose(cut.pressures_pa, whole.pressures_pa, atol=300.0)


@each_flowing
def test_without_vacuum_a_chamber_exhausts_to_ambient_and_with_it_below(name: Valves) -> None:
    """A chamber that may be evacuated comes to its lowest pressure, though that takes its time."""
    assert stepped_pa(made(name, LOGGED), 1e5, 0.0).min() >= 0.0
    lowest_pa = inside(PAPER, 0.0)
    found_pa = stepped_pa(made(name, PAPER), lowest_pa)
    assert lowest_pa <= found_pa[-1] < lowest_pa + 0.01 * 1.8e5


@each_flowing
def test_the_same_calls_with_the_same_seed_give_the_same_bits(name: Valves) -> None:
    arm = SimulatedArm(PAPER, NOMINAL[name], 5)
    first = session(arm)
    assert session(arm) == first
    assert session(SimulatedArm(PAPER, NOMINAL[name], 5)) == first
    assert session(SimulatedArm(PAPER, NOMINAL[name], 6)) != first
    assert session(SimulatedArm(PAPER, NOMINAL["servo"], 5)) != first


def test_switched_valves_move_the_air_at_the_start_of_each_period_and_then_rest() -> None:
    """The ripple: at half an error's full opening half of every period is still."""
    nominal = NOMINAL["onoff"]
    assert isinstance(nominal, SwitchingParameters)
    valve, period_s = made("onoff"), 1.0 / nominal.valve_pwm_hz
    valve.command(everywhere(2e4), 0.0)
    moves = np.diff(advanced_pa(valve, 0.0, 8 * period_s)) > 1.0
    edges = np.flatnonzero(np.diff(moves.astype(int)) == 1) * STEP_S
    assert 3 <= len(edges) <= 8
    np.testing.assert_allclose(np.diff(edges), period_s, atol=1.5 * STEP_S)
    assert 0.1 < moves.mean() < 0.9


#: Times (s) to 63 % and to 90 % of a step from and to some psi, over the repetitions in the logs.
ITV_LOGS = {
    (1.5, 5.0): ((0.32, 0.39), (0.58, 0.69)),
    (1.5, 15.0): ((0.54, 0.58), (0.94, 0.98)),
    (1.5, 25.0): ((0.79, 0.84), (1.41, 1.44)),
    (5.0, 1.5): ((1.36, 1.76), (2.2, 2.5)),
    (15.0, 1.5): ((1.36, 1.76), (2.2, 2.5)),
    (25.0, 1.5): ((1.36, 1.76), (2.2, 2.5)),
}


@pytest.mark.parametrize("step", ITV_LOGS)
def test_itv_takes_the_times_of_the_logs(step: tuple[float, float]) -> None:
    """Inside their spread, to 3 % of it; nothing moves before the least dead time of the logs."""
    start_pa, end_pa = PSI_PA * step[0], PSI_PA * step[1]
    answer_pa = stepped_pa(made("itv", LOGGED), start_pa, end_pa)
    begun_pa = stepped_pa(made("itv", LOGGED), start_pa)[-1]
    share = (answer_pa - begun_pa) / (answer_pa[-1] - begun_pa)
    assert share[round(0.045 / STEP_S)] < 0.01
    for reached, (low_s, high_s) in zip((0.63, 0.9), ITV_LOGS[step], strict=True):
        time_s = STEP_S * (1 + np.argmax(share >= reached))
        assert 0.97 * low_s <= time_s <= 1.03 * high_s

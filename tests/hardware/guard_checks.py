"""What a guard must do, as functions of the class: run on the real one and on its mutants.

Bits are written as the numbers of the wire: 1 range, 2 slew, 4 not finite, 8 too old, 16 supply.
"""

from collections.abc import Callable, Sequence
from dataclasses import FrozenInstanceError
from math import inf, nan
from typing import Any

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm, Array
from tools.rig.arms import PAPER_SECTION, paper_arm, table1_arm, trunk_arm

PERIOD_S = 0.005
SLEW = PAPER_SECTION.pressure_slew_max_pa_s
HIGH, LOW = PAPER_SECTION.pressure_max_pa, PAPER_SECTION.pressure_min_pa
NOTHING, RANGE, SLEWED, NOT_FINITE, TOO_OLD, SUPPLY = 0, 1, 2, 4, 8, 16

Check = Callable[[Any], None]
CHECKS: list[Check] = []


def check(function: Check) -> Check:
    """Add a function to what every guard must pass."""
    CHECKS.append(function)
    return function


def filled(values: object) -> Array:
    return np.array(values, dtype=float).reshape(1, 3)


#: So long a period that no slew binds: where something else is looked at.
UNHURRIED_S = 10.0


def ready(
    Guard: Any,
    sent: object = (0.0, 0.0, 0.0),
    flow_pa_s: float = inf,
    exchange_s: float = 0.0,
) -> Any:
    """Guard that has seen a write acknowledged at time 0."""
    guard = Guard(paper_arm(), PERIOD_S, flow_pa_s, exchange_s)
    guard.acknowledge(filled(sent), 0.0)
    return guard


def expect(guarded: Any, pressures_pa: object, bits: int) -> None:
    """The pressures to the last bit, and the reasons."""
    np.testing.assert_array_equal(guarded.pressures_pa, np.array(pressures_pa, ndmin=2))
    assert int(guarded.intervention) == bits


# --- range -------------------------------------------------------------------------------------


@check
def what_is_allowed_passes_unchanged(Guard: Any) -> None:
    for values in ([0.0, 0.0, 0.0], [LOW, HIGH, 1.0], [1e4, -2e4, 3e4], [-1.0, -1e-9, 1e-300]):
        guard = ready(Guard, exchange_s=UNHURRIED_S)
        expect(guard.check(filled(values), 10.0, 10.0), values, NOTHING)


@check
def a_pressure_beyond_its_range_is_brought_back_alone(Guard: Any) -> None:
    for wanted, bound in ((HIGH + 1e-3, HIGH), (HIGH + 1.0, HIGH), (LOW - 1e-3, LOW), (-9e9, LOW)):
        guard = ready(Guard, exchange_s=UNHURRIED_S)
        guarded = guard.check(filled([100.0, wanted, -100.0]), 10.0, 10.0)
        expect(guarded, [100.0, bound, -100.0], RANGE)


@check
def what_a_device_sent_beyond_the_range_does_not_widen_it(Guard: Any) -> None:
    guard = ready(Guard, (HIGH + 500.0, LOW - 500.0, 0.0))
    expect(guard.check(filled([HIGH, LOW, 0.0]), 1e-6, 1e-6), [HIGH, LOW, 0.0], NOTHING)
    guard = ready(Guard, (0.0, LOW - 500.0, 0.0), flow_pa_s=1.0)
    assert guard.check(filled([0.0, LOW, 0.0]), 1e-6, 1e-6).pressures_pa[0, 1] == LOW


@check
def every_section_has_its_own_limits(Guard: Any) -> None:
    arm = Arm("mixed", (*paper_arm().sections, *table1_arm().sections))
    guard = Guard(arm, PERIOD_S, exchange_period_s=UNHURRIED_S)
    guard.acknowledge(np.zeros((2, 3)), 0.0)
    slewed = guard.check(np.full((2, 3), 1e6), 0.01, 0.01).pressures_pa
    np.testing.assert_allclose(slewed, [[2e3] * 3, [4e3] * 3])
    highest = guard.check(np.full((2, 3), 1e6), 10.0, 10.0).pressures_pa
    np.testing.assert_array_equal(highest, [[0.9e5] * 3, [1.2e5] * 3])
    lowest = guard.check(np.full((2, 3), -1e6), 10.0, 10.0).pressures_pa
    np.testing.assert_array_equal(lowest, [[-0.9e5] * 3, [0.0] * 3])


# --- slew --------------------------------------------------------------------------------------


@check
def a_change_is_slowed_to_the_slew_in_both_directions(Guard: Any) -> None:
    for sign in (1.0, -1.0):
        guard = ready(Guard, (1e4, 1e4, 1e4))
        guarded = guard.check(filled([1e4 + sign * 5e4, 1e4, 1e4]), 0.01, 0.01)
        np.testing.assert_allclose(guarded.pressures_pa, [[1e4 + sign * SLEW * 0.01, 1e4, 1e4]])
        assert int(guarded.intervention) == SLEWED


@check
def the_slew_counts_from_the_last_write_that_was_acknowledged(Guard: Any) -> None:
    guard = ready(Guard)
    for now_s in (0.005, 0.010, 0.015, 0.020):  # the device answers none of these
        guarded = guard.check(filled(3 * [HIGH]), now_s, now_s)
        np.testing.assert_allclose(guarded.pressures_pa, SLEW * now_s)
    guard.acknowledge(filled(3 * [5e3]), 0.020)
    guarded = guard.check(filled(3 * [HIGH]), 0.03, 0.03)
    np.testing.assert_allclose(guarded.pressures_pa, 5e3 + SLEW * 0.01)


@check
def a_gap_saves_up_no_more_than_four_periods(Guard: Any) -> None:
    for more, period_s in (((), PERIOD_S), ((inf, 0.001), PERIOD_S), ((inf, 0.02), 0.02)):
        for gap_s in (4.1 * period_s, 0.3, 1e6):
            guard = Guard(paper_arm(), PERIOD_S, *more)
            guard.acknowledge(np.zeros((1, 3)), 0.0)
            guarded = guard.check(filled([HIGH, -SLEW * 3.9 * period_s, 0.0]), gap_s, gap_s)
            expected = [min(HIGH, 4.0 * SLEW * period_s), -SLEW * 3.9 * period_s, 0.0]
            np.testing.assert_allclose(guarded.pressures_pa, [expected])
    guard = ready(Guard, flow_pa_s=1e5)
    guarded = guard.check(filled([1e4, 0.0, 0.0]), 60.0, 60.0)
    np.testing.assert_allclose(guarded.pressures_pa, [[1e5 * 4.0 * PERIOD_S, 0.0, 0.0]])


@check
def before_the_first_write_a_command_may_rise_by_one_period_only(Guard: Any) -> None:
    guard = Guard(paper_arm(), PERIOD_S)
    for now_s in (100.0, 100.5, 200.0):
        guarded = guard.check(filled(3 * [HIGH]), now_s, now_s)
        np.testing.assert_allclose(guarded.pressures_pa, SLEW * PERIOD_S)


@check
def a_clock_that_goes_back_allows_no_change(Guard: Any) -> None:
    guard = Guard(paper_arm(), PERIOD_S)
    guard.acknowledge(filled(3 * [1e4]), 5.0)
    expect(guard.check(filled(3 * [HIGH]), 4.0, 4.0), 3 * [1e4], SLEWED)
    expect(guard.check(filled(3 * [HIGH]), 5.0, 5.0), 3 * [1e4], SLEWED)


# --- finiteness --------------------------------------------------------------------------------


@check
def what_is_not_a_number_keeps_the_last_sent_value_alone(Guard: Any) -> None:
    for bad in (nan, inf, -inf):
        guarded = ready(Guard, (1e4, 2e4, -3e4)).check(filled([bad, 2.1e4, bad]), 1.0, 1.0)
        expect(guarded, [1e4, 2.1e4, -3e4], NOT_FINITE)


@check
def a_device_that_answers_nonsense_does_not_reach_the_next_command(Guard: Any) -> None:
    guard = ready(Guard, (1e4, 2e4, 3e4))
    guard.acknowledge(filled([nan, inf, 3e4]), 1.0)
    expect(guard.check(filled([nan, nan, 3e4]), 1.0, 1.0), [1e4, 2e4, 3e4], NOT_FINITE)


@check
def several_reasons_are_reported_together(Guard: Any) -> None:
    guarded = ready(Guard).check(filled([nan, HIGH + 1.0, 0.0]), 0.005, 0.005)
    assert int(guarded.intervention) == NOT_FINITE | RANGE | SLEWED
    guard = ready(Guard, flow_pa_s=1e5)
    guarded = guard.check(filled([nan, HIGH + 1.0, 0.0]), 0.005, 0.005)
    assert int(guarded.intervention) == NOT_FINITE | RANGE | SLEWED | SUPPLY


# --- age and shape -----------------------------------------------------------------------------


@check
def a_command_is_void_after_three_periods_or_50_ms_whichever_is_longer(Guard: Any) -> None:
    command = filled([2e4, 1e4, -1e4])
    for period_s, limit_s in ((0.001, 0.05), (0.005, 0.05), (0.02, 0.06), (0.1, 0.3)):
        guard = Guard(paper_arm(), period_s)
        guard.acknowledge(command, 0.0)
        expect(guard.check(command, 10.0, 10.0 + limit_s - 1e-9), command, NOTHING)
        expect(guard.check(command, 10.0, 10.0 + limit_s + 1e-9), [0.0] * 3, TOO_OLD)
    for commanded_at_s, now_s in ((0.0, 0.05), (10.0, 10.0)):  # the ends themselves are allowed
        guard = Guard(paper_arm(), 0.001)
        guard.acknowledge(command, -10.0)
        expect(guard.check(command, commanded_at_s, now_s), command, NOTHING)


@check
def a_command_from_the_future_or_from_no_time_becomes_zeros(Guard: Any) -> None:
    for commanded_at_s, now_s in ((10.01, 10.0), (10.0 + 1e-9, 10.0), (nan, 10.0), (10.0, nan)):
        guarded = ready(Guard, (1e4, 1e4, 1e4)).check(filled(3 * [1e4]), commanded_at_s, now_s)
        expect(guarded, [0.0] * 3, TOO_OLD)
    guarded = ready(Guard, (1e4, 1e4, 1e4)).check(filled(3 * [1e4]), -inf, 10.0)
    expect(guarded, [0.0] * 3, TOO_OLD)


@check
def a_command_of_the_wrong_shape_becomes_zeros(Guard: Any) -> None:
    for shape in ((3,), (3, 1), (2, 3), (1, 4), (0, 3), (1, 1, 3), ()):
        guarded = ready(Guard).check(np.full(shape, 1e4), 10.0, 10.0)
        assert guarded.pressures_pa.shape == (1, 3)
        expect(guarded, [0.0] * 3, TOO_OLD)


@check
def zeros_for_an_old_command_have_the_shape_of_the_arm(Guard: Any) -> None:
    guarded = Guard(trunk_arm(), PERIOD_S).check(np.ones((3, 3)), 0.0, 1.0)
    assert guarded.pressures_pa.shape == (3, 3)


# --- the supply --------------------------------------------------------------------------------


@check
def without_a_limit_all_chambers_rise_at_full_slew(Guard: Any) -> None:
    guard = Guard(paper_arm(), PERIOD_S)
    guard.acknowledge(filled([0.0] * 3), 0.0)
    expect(guard.check(filled([SLEW * 0.01] * 3), 0.01, 0.01), [SLEW * 0.01] * 3, NOTHING)


@check
def a_limited_supply_shortens_all_rises_by_one_factor(Guard: Any) -> None:
    guard = ready(Guard, (1e4, 0.0, -1e4), flow_pa_s=1e5)  # 1000 Pa in 10 ms
    guarded = guard.check(filled([1.15e4, 500.0, -1e4]), 0.01, 0.01)  # 2000 Pa are wanted
    np.testing.assert_allclose(guarded.pressures_pa, [[1e4 + 750.0, 250.0, -1e4]])
    assert int(guarded.intervention) == SUPPLY


@check
def falls_are_free_and_feed_no_rise(Guard: Any) -> None:
    guard = ready(Guard, (1e4, 2e4, 0.0), flow_pa_s=1e5)
    guarded = guard.check(filled([1.15e4, 1.85e4, -1e3]), 0.01, 0.01)
    np.testing.assert_allclose(guarded.pressures_pa, [[1.1e4, 1.85e4, -1e3]])
    assert int(guarded.intervention) == SUPPLY
    guard = ready(Guard, (1e4, 2e4, 3e4), flow_pa_s=10.0)  # 0.1 Pa in 10 ms
    expect(guard.check(filled([9e3, 1.9e4, 3e4]), 0.01, 0.01), [9e3, 1.9e4, 3e4], NOTHING)


@check
def what_the_supply_can_feed_passes(Guard: Any) -> None:
    guard = ready(Guard, flow_pa_s=1e5)
    expect(guard.check(filled([500.0, 250.0, 249.0]), 0.01, 0.01), [500.0, 250.0, 249.0], NOTHING)
    expect(guard.check(filled([1000.0, 0.0, -900.0]), 0.01, 0.01), [1000.0, 0.0, -900.0], NOTHING)


@check
def a_supply_that_feeds_nothing_lets_nothing_rise(Guard: Any) -> None:
    guarded = ready(Guard, flow_pa_s=0.0).check(filled([100.0, 1.0, -100.0]), 0.01, 0.01)
    expect(guarded, [0.0, 0.0, -100.0], SUPPLY)


@check
def the_supply_counts_what_is_left_after_the_slew(Guard: Any) -> None:
    guard = ready(Guard, flow_pa_s=1.25 * SLEW)
    guarded = guard.check(filled([HIGH, 0.0, 0.0]), 0.01, 0.01)
    np.testing.assert_allclose(guarded.pressures_pa, [[SLEW * 0.01, 0.0, 0.0]])
    assert int(guarded.intervention) == SLEWED


# --- the rest ----------------------------------------------------------------------------------


@check
def neither_command_nor_acknowledgement_is_kept_by_reference(Guard: Any) -> None:
    for arm in (paper_arm(), table1_arm(), trunk_arm()):
        guard = Guard(arm, PERIOD_S)
        sent = np.full((arm.n_sections, 3), 100.0)
        guard.acknowledge(sent, 0.0)
        sent += 5e4
        guarded = guard.check(np.full((arm.n_sections, 3), nan), 0.0, 0.0)
        np.testing.assert_array_equal(guarded.pressures_pa, 100.0)


@check
def what_was_found_cannot_be_changed_afterwards(Guard: Any) -> None:
    guarded = ready(Guard).check(filled([0.0] * 3), 0.0, 0.0)
    with pytest.raises(FrozenInstanceError):
        guarded.intervention = 0


def safe_over(Guard: Any, commands: Sequence[tuple[Any, float, float, bool]]) -> None:
    """Whatever comes stays finite, in range, within the slew and within the supply.

    A command is its values, the time since the one before, its age, and whether it is acknowledged.
    """
    flow_pa_s = 3e5
    guard = Guard(paper_arm(), PERIOD_S, flow_pa_s)
    now_s, acknowledged, acknowledged_at_s = 1.0, np.zeros((1, 3)), None
    for values, waited_s, age_s, answers in commands:
        now_s += waited_s
        command = filled(values)
        guarded = guard.check(command, now_s - age_s, now_s)
        sent, bits = guarded.pressures_pa, int(guarded.intervention)
        assert sent.shape == (1, 3)
        assert np.isfinite(sent).all()
        assert (sent >= LOW).all()
        assert (sent <= HIGH).all()
        elapsed_s = PERIOD_S if acknowledged_at_s is None else now_s - acknowledged_at_s
        if bits & TOO_OLD:
            np.testing.assert_array_equal(sent, 0.0)
        else:
            rises = np.maximum(sent - acknowledged, 0.0)
            assert (np.abs(sent - acknowledged) <= SLEW * elapsed_s + 1e-6).all()
            assert rises.sum() <= flow_pa_s * elapsed_s + 1e-6
            assert (bits == NOTHING) == np.array_equal(sent, command)
        if answers:
            guard.acknowledge(sent, now_s)
            acknowledged, acknowledged_at_s = sent, now_s


@check
def random_commands_stay_safe(Guard: Any) -> None:
    rng = np.random.default_rng(1)
    special = np.array([nan, inf, -inf, 1e300, -1e300, 0.0, LOW, HIGH])
    commands = []
    for _ in range(100):
        values = np.where(rng.random(3) < 0.2, rng.choice(special, 3), rng.uniform(-2e5, 2e5, 3))
        wait_s, age_s = float(rng.uniform(0.0, 0.3)), float(rng.uniform(-0.01, 0.1))
        commands.append((values, wait_s, age_s, bool(rng.random() < 0.5)))
    safe_over(Guard, commands)


@check
def where_no_time_has_passed_a_limited_supply_lets_nothing_rise(Guard: Any) -> None:
    guard = ready(Guard, (1e4, 0.0, 0.0), flow_pa_s=1e5)
    expect(guard.check(filled([1e4, 0.0, 0.0]), 0.0, 0.0), [1e4, 0.0, 0.0], NOTHING)
    expect(guard.check(filled([2e4, 0.0, 0.0]), 0.0, 0.0), [1e4, 0.0, 0.0], SLEWED)

"""The guard's properties over any sequence of commands and times, and each rule alone."""

import ast
import inspect

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.arm import Arm, Array
from hardware import guard as guard_module
from hardware.guard import Guard, Intervention
from tests.arms import ARMS, PAPER_SECTION, paper_arm, table1_arm, trunk_arm

PERIOD_S = 0.005
SLEW = PAPER_SECTION.pressure_slew_max_pa_s
HIGH, LOW = PAPER_SECTION.pressure_max_pa, PAPER_SECTION.pressure_min_pa

#: What may come from upstream, broken or not.
PRESSURES = st.one_of(
    st.floats(-2e5, 2e5), st.sampled_from([np.nan, np.inf, -np.inf, 1e300, -1e300, 0.0, LOW, HIGH])
)
COMMANDS = st.lists(
    st.tuples(
        st.lists(PRESSURES, min_size=3, max_size=3),
        st.floats(0.0, 0.3),  # time since the tick before
        st.floats(-0.01, 0.2),  # age of the command
        st.booleans(),  # whether the device acknowledges
    ),
    max_size=20,
)


def filled(values: object) -> Array:
    return np.array(values, dtype=float).reshape(1, 3)


def ready(sent: object = (0.0, 0.0, 0.0), arm: Arm | None = None) -> Guard:
    """Guard that has seen a write acknowledged at time 0."""
    guard = Guard(arm or paper_arm(), PERIOD_S)
    guard.acknowledge(filled(sent), 0.0)
    return guard


@given(COMMANDS)
def test_whatever_comes_stays_finite_in_range_and_within_the_slew(commands: list) -> None:
    guard = Guard(paper_arm(), PERIOD_S)
    now_s, acknowledged, acknowledged_at_s = 1.0, np.zeros((1, 3)), None
    for values, waited_s, age_s, answers in commands:
        now_s += waited_s
        command = filled(values)
        guarded = guard.check(command, now_s - age_s, now_s)
        sent = guarded.pressures_pa
        assert sent.shape == (1, 3)
        assert np.isfinite(sent).all()
        assert (sent >= LOW).all()
        assert (sent <= HIGH).all()
        elapsed_s = PERIOD_S if acknowledged_at_s is None else now_s - acknowledged_at_s
        if not guarded.intervention & Intervention.TOO_OLD:
            assert (np.abs(sent - acknowledged) <= SLEW * elapsed_s + 1e-6).all()
            assert (guarded.intervention == Intervention.NOTHING) == np.array_equal(sent, command)
        else:
            np.testing.assert_array_equal(sent, 0.0)
        if answers:
            guard.acknowledge(sent, now_s)
            acknowledged, acknowledged_at_s = sent, now_s


@given(st.lists(st.floats(LOW, HIGH), min_size=3, max_size=3))
def test_a_command_that_is_allowed_passes_unchanged(values: list[float]) -> None:
    guarded = ready().check(filled(values), 10.0, 10.0)
    np.testing.assert_array_equal(guarded.pressures_pa, filled(values))
    assert guarded.intervention == Intervention.NOTHING


@pytest.mark.parametrize(("wanted", "bound"), [(HIGH + 1.0, HIGH), (LOW - 1.0, LOW)])
def test_a_pressure_beyond_its_range_is_brought_back_alone(wanted: float, bound: float) -> None:
    guarded = ready().check(filled([100.0, wanted, -100.0]), 10.0, 10.0)
    np.testing.assert_array_equal(guarded.pressures_pa, filled([100.0, bound, -100.0]))
    assert guarded.intervention == Intervention.RANGE


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_change_is_slowed_to_the_slew_in_both_directions(sign: float) -> None:
    guarded = ready((1e4, 1e4, 1e4)).check(filled([1e4 + sign * 5e4, 1e4, 1e4]), 0.01, 0.01)
    expected = filled([1e4 + sign * SLEW * 0.01, 1e4, 1e4])
    np.testing.assert_allclose(guarded.pressures_pa, expected)
    assert guarded.intervention == Intervention.SLEW


def test_the_slew_counts_from_the_last_write_that_was_acknowledged() -> None:
    guard = ready()
    for now_s in (0.005, 0.010, 0.015, 0.020):  # the device answers none of these
        guarded = guard.check(filled(3 * [HIGH]), now_s, now_s)
        np.testing.assert_allclose(guarded.pressures_pa, SLEW * now_s)


def test_before_the_first_write_a_command_may_rise_by_one_period_only() -> None:
    guard = Guard(paper_arm(), PERIOD_S)
    for now_s in (100.0, 100.5, 200.0):
        guarded = guard.check(filled(3 * [HIGH]), now_s, now_s)
        np.testing.assert_allclose(guarded.pressures_pa, SLEW * PERIOD_S)


def test_a_clock_that_goes_back_allows_no_change() -> None:
    guard = Guard(paper_arm(), PERIOD_S)
    guard.acknowledge(filled(3 * [1e4]), 5.0)
    guarded = guard.check(filled(3 * [HIGH]), 4.0, 4.0)
    np.testing.assert_array_equal(guarded.pressures_pa, 1e4)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_a_number_keeps_the_last_sent_value_alone(bad: float) -> None:
    guarded = ready((1e4, 2e4, -3e4)).check(filled([bad, 2.1e4, bad]), 1.0, 1.0)
    np.testing.assert_array_equal(guarded.pressures_pa, filled([1e4, 2.1e4, -3e4]))
    assert guarded.intervention == Intervention.NOT_FINITE


@pytest.mark.parametrize(
    ("period_s", "limit_s"), [(0.001, 0.05), (0.005, 0.05), (0.02, 0.06), (0.1, 0.3)]
)
def test_a_command_is_void_after_three_periods_or_50_ms_whichever_is_longer(
    period_s: float, limit_s: float
) -> None:
    guard = Guard(paper_arm(), period_s)
    guard.acknowledge(filled(3 * [2e4]), 0.0)
    command = filled([2e4, 1e4, -1e4])
    just_in_time = guard.check(command, 10.0, 10.0 + limit_s - 1e-9)
    assert just_in_time.intervention == Intervention.NOTHING
    too_late = guard.check(command, 10.0, 10.0 + limit_s + 1e-9)
    assert too_late.intervention == Intervention.TOO_OLD
    np.testing.assert_array_equal(too_late.pressures_pa, np.zeros((1, 3)))


@pytest.mark.parametrize(
    ("commanded_at_s", "now_s"), [(10.01, 10.0), (np.nan, 10.0), (10.0, np.nan), (-np.inf, 10.0)]
)
def test_a_command_from_the_future_or_from_no_time_becomes_zeros(
    commanded_at_s: float, now_s: float
) -> None:
    guarded = ready((1e4, 1e4, 1e4)).check(filled(3 * [1e4]), commanded_at_s, now_s)
    np.testing.assert_array_equal(guarded.pressures_pa, np.zeros((1, 3)))
    assert guarded.intervention == Intervention.TOO_OLD


@pytest.mark.parametrize("shape", [(3,), (3, 1), (2, 3), (1, 4), (0, 3), (1, 1, 3), ()])
def test_a_command_of_the_wrong_shape_becomes_zeros(shape: tuple[int, ...]) -> None:
    guarded = ready().check(np.full(shape, 1e4), 10.0, 10.0)
    np.testing.assert_array_equal(guarded.pressures_pa, np.zeros((1, 3)))
    assert guarded.intervention != Intervention.NOTHING


def test_a_device_that_answers_nonsense_does_not_reach_the_next_command() -> None:
    guard = ready((1e4, 2e4, 3e4))
    guard.acknowledge(filled([np.nan, np.inf, 3e4]), 1.0)
    guarded = guard.check(filled([np.nan, np.nan, 3e4]), 1.0, 1.0)
    np.testing.assert_array_equal(guarded.pressures_pa, filled([1e4, 2e4, 3e4]))


def test_a_device_that_sent_beyond_the_range_does_not_widen_it() -> None:
    guard = ready((HIGH + 500.0, LOW - 500.0, 0.0))
    guarded = guard.check(filled([HIGH, LOW, 0.0]), 1e-6, 1e-6)
    np.testing.assert_array_equal(guarded.pressures_pa, filled([HIGH, LOW, 0.0]))


def test_several_reasons_are_reported_together() -> None:
    guarded = ready().check(filled([np.nan, HIGH + 1.0, 0.0]), 0.005, 0.005)
    both = Intervention.NOT_FINITE | Intervention.RANGE | Intervention.SLEW
    assert guarded.intervention == both


def test_every_section_has_its_own_limits() -> None:
    arm = Arm("mixed", (*paper_arm().sections, *table1_arm().sections))
    guard = Guard(arm, PERIOD_S)
    guard.acknowledge(np.zeros((2, 3)), 0.0)
    slewed = guard.check(np.full((2, 3), 1e6), 0.01, 0.01).pressures_pa
    np.testing.assert_allclose(slewed, [[2e3] * 3, [4e3] * 3])
    highest = guard.check(np.full((2, 3), 1e6), 10.0, 10.0).pressures_pa
    np.testing.assert_array_equal(highest, [[0.9e5] * 3, [1.2e5] * 3])
    lowest = guard.check(np.full((2, 3), -1e6), 10.0, 10.0).pressures_pa
    np.testing.assert_array_equal(lowest, [[-0.9e5] * 3, [0.0] * 3])


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_neither_command_nor_acknowledgement_is_kept_by_reference(arm: Arm) -> None:
    guard = Guard(arm, PERIOD_S)
    sent = np.full((arm.n_sections, 3), 100.0)
    guard.acknowledge(sent, 0.0)
    sent += 5e4
    guarded = guard.check(np.full((arm.n_sections, 3), np.nan), 0.0, 0.0)
    np.testing.assert_array_equal(guarded.pressures_pa, 100.0)


def test_zeros_for_an_old_command_have_the_shape_of_the_arm() -> None:
    guarded = Guard(trunk_arm(), PERIOD_S).check(np.ones((3, 3)), 0.0, 1.0)
    assert guarded.pressures_pa.shape == (3, 3)


def test_the_guard_imports_nothing_of_ours_but_the_arm_and_the_errors() -> None:
    tree = ast.parse(inspect.getsource(guard_module))
    modules = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    modules |= {
        name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names
    }
    ours = {name for name in modules if name and name.split(".")[0] in ("controllers", "hardware")}
    assert ours <= {"controllers.arm", "controllers.errors"}

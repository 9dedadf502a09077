"""The guard passes every check; over any sequence of commands and times it lets nothing through."""

import ast
import inspect

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.hardware import guard as guard_module
from pneuarm.hardware.guard import Guard, Intervention
from tests.hardware.guard_checks import (
    CHECKS,
    HIGH,
    LOW,
    UNHURRIED_S,
    Check,
    filled,
    ready,
    safe_over,
)

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


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_the_guard(check: Check) -> None:
    check(Guard)


@given(COMMANDS)
def test_whatever_comes_stays_finite_in_range_within_slew_and_supply(commands: list) -> None:
    safe_over(Guard, commands)


@given(st.lists(st.floats(LOW, HIGH), min_size=3, max_size=3))
def test_a_command_that_is_allowed_passes_unchanged(values: list[float]) -> None:
    guarded = ready(Guard, exchange_s=UNHURRIED_S).check(filled(values), 10.0, 10.0)
    np.testing.assert_array_equal(guarded.pressures_pa, filled(values))
    assert guarded.intervention == Intervention.NOTHING


def test_the_bits_are_those_of_the_wire() -> None:
    bits = {kind.name: kind.value for kind in Intervention}
    assert bits == {"RANGE": 1, "SLEW": 2, "NOT_FINITE": 4, "TOO_OLD": 8, "SUPPLY": 16}


def test_the_guard_imports_nothing_of_ours_but_the_arm_and_the_errors() -> None:
    tree = ast.parse(inspect.getsource(guard_module))
    modules = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    modules |= {
        name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names
    }
    ours = {name for name in modules if name and name.split(".")[0] in ("controllers", "hardware")}
    assert ours <= {"pneuarm.controllers.arm.arm", "pneuarm.controllers.arm.errors"}

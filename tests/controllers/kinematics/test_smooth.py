"""The functions of the bending angle against arbitrary precision, and where the forms meet."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.kinematics.smooth import s_and_c, smooth
from tools.validation import precise

NAMES = ("s", "c", "e", "ds", "dc")


@pytest.mark.parametrize("theta", [0.0, 5e-324, 1e-200, 1e-12, 1e-8, 1e-4, 1e-3, 0.03, 0.5, 1.0])
def test_near_the_straight_arm_every_digit_holds(theta: float) -> None:
    ours, exact = smooth(np.array([theta**2])), precise.smooth(theta**2)
    for name in NAMES:
        assert getattr(ours, name)[0] == pytest.approx(exact[name], rel=1e-15, abs=0.0), name


@given(st.floats(0.0, 9.0))
def test_every_function_is_exact_over_more_than_a_turn(theta: float) -> None:
    ours, exact = smooth(np.array([theta**2])), precise.smooth(theta**2)
    for name in NAMES:
        assert getattr(ours, name)[0] == pytest.approx(exact[name], rel=0.0, abs=2e-15), name


@pytest.mark.parametrize("name", NAMES)
def test_series_and_closed_form_meet_without_a_step(name: str) -> None:
    below, above = (2.0 * np.pi * (1.0 + np.array([-1e-15, 1e-15]))) ** 2
    assert below < 4.0 * np.pi**2 < above
    at = [getattr(smooth(np.array([q])), name)[0] for q in (below, above)]
    assert at[0] == pytest.approx(at[1], abs=4e-15)


def test_one_large_angle_does_not_change_the_others() -> None:
    q = np.linspace(0.0, 30.0, 7)
    together = smooth(np.append(q, 100.0))
    for name in NAMES:
        np.testing.assert_array_equal(getattr(together, name)[:-1], getattr(smooth(q), name))
        assert getattr(together, name)[-1] == pytest.approx(precise.smooth(100.0)[name], abs=1e-15)


@pytest.mark.parametrize("name", ["s", "c"])
def test_the_derivatives_are_those_of_the_functions(name: str) -> None:
    q, step = np.linspace(0.1, 30.0, 50), 1e-4
    numerical = (getattr(smooth(q + step), name) - getattr(smooth(q - step), name)) / (2.0 * step)
    np.testing.assert_allclose(getattr(smooth(q), "d" + name), numerical, atol=1e-10)


@given(st.lists(st.floats(0.0, 60.0), min_size=1, max_size=5))
def test_the_fast_pair_is_the_pair_of_all(angles_squared: list[float]) -> None:
    q = np.array(angles_squared)
    s, c = s_and_c(q)
    np.testing.assert_allclose(s, smooth(q).s, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(c, smooth(q).c, rtol=0.0, atol=1e-15)


def test_the_straight_arm_has_the_limits_themselves() -> None:
    at = smooth(np.zeros(1))
    assert [getattr(at, name)[0] for name in NAMES] == pytest.approx(
        [1.0, 0.5, 1.0 / 6.0, -1.0 / 6.0, -1.0 / 24.0], rel=1e-16
    )


def test_a_nan_stays_where_it_is() -> None:
    s, c = s_and_c(np.array([1.0, np.nan]))
    assert np.isnan([s[1], c[1]]).all()
    assert np.isfinite([s[0], c[0]]).all()

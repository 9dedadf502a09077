"""The ramp down: in proportion, never faster than its rate, and it ends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.service.safety.safety import Ramp

PRESSURES = st.lists(st.floats(-1e5, 1e5), min_size=3, max_size=3)


@given(PRESSURES, st.floats(1e3, 1e6))
def test_it_goes_to_zero_in_proportion_at_its_rate(values: list[float], rate_pa_s: float) -> None:
    start = np.array([values])
    ramp = Ramp(start, rate_pa_s, 10.0)
    largest = float(np.abs(start).max())
    duration_s = largest / rate_pa_s
    assert ramp.over(10.0 + 1.000001 * duration_s + 1e-9)
    if duration_s < 1e-6:
        return
    assert not ramp.over(10.0 + 0.999 * duration_s)
    for share in (0.0, 0.25, 0.9):
        wanted = ramp.pressures_pa(10.0 + share * duration_s)
        np.testing.assert_allclose(wanted, (1.0 - share) * start, atol=1e-6 * largest)


def test_what_is_not_known_counts_as_empty() -> None:
    ramp = Ramp(np.array([[np.nan, 1e4, np.inf]]), 1e4, 0.0)
    assert ramp.pressures_pa(0.5) == pytest.approx(np.array([[0.0, 5e3, 0.0]]))
    assert ramp.over(1.0)


def test_an_empty_arm_is_down_at_once() -> None:
    assert Ramp(np.zeros((2, 3)), 1e4, 5.0).over(5.0)

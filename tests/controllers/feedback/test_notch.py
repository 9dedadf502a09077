"""A correction behind the notch does not make the lowest mode swing, and arrives whole."""

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Response
from pneuarm.controllers.feedback.notch import Notch
from pneuarm.controllers.feedback.prediction import discrete

RESPONSE = Response(
    delay_s=0.007, filling_lag_s=0.01, exhausting_lag_s=0.01, mode_hz=2.2, damping_ratio=0.13
)
PERIOD_S = 1e-3


def answer(commands: np.ndarray) -> np.ndarray:
    """Where the body (n,) is under commands (n,) from rest at 0."""
    step, driven = discrete(RESPONSE, PERIOD_S)
    state, found = np.zeros(3), []
    for command in commands:
        state = step @ state + driven[:, 0] * command
        found.append(state[1])
    return np.array(found)


def test_a_correction_ends_whole_and_swings_nothing() -> None:
    notch = Notch(RESPONSE)
    wanted = np.array([4e-3, 0.0, -1e-3])
    calm = np.array([notch.step(wanted, PERIOD_S) for _ in range(2000)])
    assert calm[-1] == pytest.approx(wanted, abs=1e-9)
    assert answer(np.full(2000, 4e-3)).max() > 1.6 * 4e-3
    assert answer(calm[:, 0]).max() < 1.02 * 4e-3


def test_a_restart_is_no_change() -> None:
    notch = Notch(RESPONSE)
    notch.step(np.ones(3), PERIOD_S)
    value = np.array([1e-3, 2e-3, 3e-3])
    notch.restart(value)
    assert notch.step(value, PERIOD_S) == pytest.approx(value, abs=1e-15)

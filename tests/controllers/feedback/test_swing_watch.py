"""A swing that lasts is found; one that dies out, noise, and a target's motion are none."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.feedback.swing_watch import SwingWatch

LEAST_M = 1e-3
ALONG = np.array([0.8, -0.6, 0.1])


def found(tips_m: Array, camera_hz: float, stands: bool = True) -> tuple[SwingWatch, list[float]]:
    """The watch, and when (s) it has found a swing."""
    watch = SwingWatch(LEAST_M)
    at_s = [n / camera_hz for n, tip in enumerate(tips_m) if watch.look(tip, 1 / camera_hz, stands)]
    return watch, at_s


def swing(
    amplitude_m: float, hz: float, camera_hz: float, seconds: float, noise_m: float = 1e-4
) -> Array:
    at_s = np.arange(round(seconds * camera_hz)) / camera_hz
    noise = np.random.default_rng(5).normal(0.0, noise_m, (len(at_s), 3))
    return amplitude_m * np.sin(2.0 * np.pi * hz * at_s)[:, None] * ALONG + noise


@given(
    st.floats(2e-3, 0.05),
    st.floats(0.05, 2.0),
    st.floats(6.0, 100.0),
)
def test_a_lasting_swing_is_found_with_its_size_and_period(
    amplitude_m: float, hz: float, poses_a_period: float
) -> None:
    camera_hz = hz * poses_a_period
    watch, at_s = found(swing(amplitude_m, hz, camera_hz, 4.2 / hz), camera_hz)
    assert len(at_s) == 1
    assert watch.way_m == pytest.approx(2.0 * 0.8 * amplitude_m, rel=0.2, abs=5e-4)
    assert watch.period_s == pytest.approx(1.0 / hz, rel=0.2)


@given(st.floats(0.0, 2e-3), st.sampled_from([5.0, 50.0, 200.0]))
def test_noise_is_no_swing(noise_m: float, camera_hz: float) -> None:
    tips = swing(0.0, 1.0, camera_hz, 2000.0 / camera_hz, noise_m)
    assert found(tips, camera_hz)[1] == []


@given(st.floats(0.04, 0.5), st.floats(1.0, 4.0), st.floats(2e-3, 0.1))
def test_a_mode_that_dies_out_is_no_swing(
    damping_ratio: float, hz: float, amplitude_m: float
) -> None:
    tips = swing(amplitude_m, hz, 100.0, 6.0, 0.0)
    at_s = np.arange(len(tips)) * 0.01
    tips *= np.exp(-damping_ratio * 2.0 * np.pi * hz * at_s)[:, None]
    assert found(tips, 100.0)[1] == []


def test_a_tip_that_comes_and_overshoots_is_no_swing() -> None:
    at_s = np.arange(1000) * 0.01
    way = 1.0 - np.exp(-at_s) * np.cos(3.0 * at_s)
    assert found(0.05 * way[:, None] * ALONG, 100.0)[1] == []


def test_a_tip_that_is_to_move_does_not_swing() -> None:
    assert found(swing(0.02, 0.5, 100.0, 20.0), 100.0, stands=False)[1] == []


def test_a_swing_that_goes_on_is_found_again() -> None:
    at_s = found(swing(0.02, 1.0, 100.0, 30.0), 100.0)[1]
    assert len(at_s) > 5

"""A swing that lasts is found; one that dies out, noise, and a target's motion are none."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.feedback.swing_watch import SwingWatch
from pneuarm.controllers.geometry.moving_point import MovingPoint
from pneuarm.controllers.targets.targets import CircleTarget

LEAST_M = 1e-3
ALONG = np.array([0.8, -0.6, 0.1])


STANDS = MovingPoint([0.0] * 3, [0.0] * 3, [0.0] * 3)


def found(
    tips_m: Array, camera_hz: float, wanted: Callable[[float], MovingPoint] = lambda _: STANDS
) -> tuple[SwingWatch, list[float]]:
    """The watch, and when (s) it has found a swing around what is wanted at a time (s)."""
    watch, at_s = SwingWatch(LEAST_M), []
    for number, tip_m in enumerate(tips_m):
        now_s = number / camera_hz
        if watch.look(tip_m, wanted(now_s), 1.0 / camera_hz):
            at_s.append(now_s)
    return watch, at_s


def circle(hz: float) -> Callable[[float], MovingPoint]:
    """A radius of 30 mm."""
    return CircleTarget((0, 0, 0.2), (1, 0, 0), (0, 1, 0), 0.03, hz).at


def swing(
    amplitude_m: float, hz: float, camera_hz: float, seconds: float, noise_m: float = 1e-4
) -> Array:
    at_s = np.arange(round(seconds * camera_hz)) / camera_hz
    noise = np.random.default_rng(5).normal(0.0, noise_m, (len(at_s), 3))
    return amplitude_m * np.sin(2.0 * np.pi * hz * at_s)[:, None] * ALONG + noise


@given(
    st.floats(2e-3, 0.05),
    st.floats(0.05, 2.0),
    st.floats(8.0, 100.0),
)
def test_a_lasting_swing_is_found_with_its_size_and_period(
    amplitude_m: float, hz: float, poses_a_period: float
) -> None:
    camera_hz = hz * poses_a_period
    seconds = max(4.7 / hz, 2.0 + 2.2 / hz)
    watch, at_s = found(swing(amplitude_m, hz, camera_hz, seconds), camera_hz)
    assert len(at_s) == 1
    assert watch.way_m == pytest.approx(2.0 * 0.8 * amplitude_m, rel=0.2, abs=5e-4)
    assert watch.period_s == pytest.approx(1.0 / hz, rel=0.2)


@given(st.floats(0.0, 2e-3), st.sampled_from([5.0, 50.0, 200.0]))
def test_noise_is_no_swing(noise_m: float, camera_hz: float) -> None:
    tips = swing(0.0, 1.0, camera_hz, 2000.0 / camera_hz, noise_m)
    assert found(tips, camera_hz)[1] == []


@given(st.floats(0.05, 0.5), st.floats(1.0, 4.0), st.floats(2e-3, 0.1))
def test_a_mode_that_dies_out_is_no_swing(
    damping_ratio: float, hz: float, amplitude_m: float
) -> None:
    tips = swing(amplitude_m, hz, 100.0, 6.0, 0.0)
    at_s = np.arange(len(tips)) * 0.01
    tips *= np.exp(-damping_ratio * 2.0 * np.pi * hz * at_s)[:, None]
    assert found(tips, 100.0)[1] == []


def test_a_mode_that_a_move_excites_is_no_swing_before_it_had_time_to_die_out() -> None:
    """Four periods of one size while the reference moves, and then it dies out."""
    tips = swing(5e-3, 2.0, 100.0, 5.0, 0.0)
    at_s = np.arange(len(tips)) * 0.01
    tips *= np.exp(-0.1 * 2.0 * np.pi * 2.0 * np.maximum(at_s - 1.2, 0.0))[:, None]
    assert found(tips, 100.0)[1] == []


def test_a_tip_that_comes_and_overshoots_is_no_swing() -> None:
    at_s = np.arange(1000) * 0.01
    way = 1.0 - np.exp(-at_s) * np.cos(3.0 * at_s)
    assert found(0.05 * way[:, None] * ALONG, 100.0)[1] == []


@given(st.floats(0.05, 0.5), st.floats(5.0, 20.0))
def test_a_swing_on_a_slow_circle_is_found(hz: float, quicker: float) -> None:
    seconds = 3.0 / hz + 3.0
    at_s = np.arange(round(seconds * 100.0)) * 0.01
    way = np.array([circle(hz)(time_s).position for time_s in at_s.tolist()])
    tips = way + swing(0.01, quicker * hz, 100.0, seconds)[: len(way)]
    assert found(tips, 100.0, circle(hz))[1]


@given(
    st.floats(0.05, 1.0),
    st.lists(st.floats(-0.02, 0.02), min_size=6, max_size=6),
    st.floats(0.0, 6.28),
)
def test_what_comes_with_the_turns_of_a_circle_is_no_swing(
    hz: float, sizes_m: list[float], phase: float
) -> None:
    """A tip that is behind, and chambers that turn six times in every turn of the circle."""
    at_s = np.arange(round(5.0 / hz * 50.0)) * 0.02
    way = np.array([circle(hz)(time_s).position for time_s in at_s.tolist()])
    angle = 2.0 * np.pi * hz * at_s[:, None] + phase
    behind, turns = np.array(sizes_m[:3]), np.array(sizes_m[3:])
    error = behind * np.sin(angle) + turns * np.sin(3.0 * angle)
    assert found(way + error, 50.0, circle(hz))[1] == []


def test_a_swing_that_goes_on_is_found_again() -> None:
    at_s = found(swing(0.02, 1.0, 100.0, 30.0), 100.0)[1]
    assert len(at_s) > 5

"""The law: it converges on arms that differ much from the believed one, within its bound."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuarm.controllers.arm.errors import LearningError
from pneuarm.controllers.learning.course import STEP_S
from pneuarm.controllers.learning.law import (
    GAIN,
    LONGEST_S,
    Law,
    cutoff_hz,
    find_advance_s,
    quietness,
)
from tests.controllers.learning.plants import MODE_HZ, Plant, bow_course

COURSE = bow_course()
MIDDLE_M = np.array([0.0, 0.0, 0.2])
SAMPLES = len(COURSE.times_s)

#: What the law is to learn on: a gain a third wrong, a mode from a fifth below the believed one,
#: hardly damped or not swinging at all, and a dead time of a slow valve.
plants = st.builds(
    Plant,
    gain=st.floats(0.7, 1.3),
    mode_hz=st.floats(0.8 * MODE_HZ, 5.0 * MODE_HZ),
    damping=st.floats(0.1, 1.0),
    delay_s=st.floats(0.0, 0.3),
)
offsets = st.integers(0, 2**31).map(
    lambda seed: np.random.default_rng(seed).normal(0.0, 0.02, (SAMPLES, 3))
)


def law_for(plant: Plant, offset_max_m: float = 1.0) -> Law:
    sent = COURSE.wanted_m
    advance_s = find_advance_s(sent, plant.tip(sent, MIDDLE_M), STEP_S)
    return Law(advance_s, cutoff_hz(advance_s, MODE_HZ, 0.05), offset_max_m, STEP_S)


@given(plants)
@settings(max_examples=200, deadline=None)
def test_the_error_of_every_frequency_becomes_smaller_from_trial_to_trial(plant: Plant) -> None:
    law, frequency_hz = law_for(plant), np.linspace(0.01, 0.5 / STEP_S, 2000)
    ahead = np.exp(2j * np.pi * frequency_hz * law.advance_s)
    kept = quietness(frequency_hz, law.cutoff_hz) * np.abs(
        1.0 - GAIN * plant.at(frequency_hz) * ahead
    )
    assert kept.max() < 1.0
    assert kept[frequency_hz < 0.25 * law.cutoff_hz].max() < 0.75


@given(plants, st.floats(0.05, 1.0), st.sampled_from([1.0, GAIN / 2.0, GAIN]))
@settings(max_examples=200, deadline=None)
def test_nothing_is_added_to_no_error(plant: Plant, bound_m: float, gain: float) -> None:
    nothing = np.zeros((SAMPLES, 3))
    np.testing.assert_array_equal(law_for(plant, bound_m).improved(nothing, nothing, gain), nothing)


@given(offsets, offsets, st.floats(1e-4, 0.05), st.floats(0.0, 1.0), st.floats(0.1, 2.0))
@settings(max_examples=200, deadline=None)
def test_what_is_learnt_is_bounded_smooth_and_begins_and_ends_with_nothing(
    offset_m: np.ndarray, error_m: np.ndarray, bound_m: float, advance_s: float, cutoff: float
) -> None:
    learnt = Law(advance_s, cutoff, bound_m, STEP_S).improved(offset_m, error_m)
    assert learnt.shape == offset_m.shape
    assert np.linalg.norm(learnt, axis=1).max() <= bound_m * (1.0 + 1e-9)
    np.testing.assert_array_equal(learnt[[0, -1]], 0.0)
    # Nothing quicker than the fade at the ends and some cutoffs.
    fastest = np.linalg.norm(np.diff(learnt, axis=0), axis=1).max() / STEP_S
    assert fastest <= bound_m * (8.0 + 2.0 * np.pi * 3.0 * cutoff)


def test_what_is_known_and_slow_stays_when_there_is_no_error() -> None:
    law = Law(0.1, 1.3, 1.0, STEP_S)
    slow = np.zeros((SAMPLES, 3))
    slow[:, 0] = 0.01 * np.sin(np.pi * np.arange(SAMPLES) / (SAMPLES - 1)) ** 4
    np.testing.assert_allclose(law.improved(slow, np.zeros_like(slow)), slow, atol=1e-4)


@given(plants)
@settings(max_examples=100, deadline=None)
def test_a_dead_time_is_found_and_a_mode_counts_with_its_lag(plant: Plant) -> None:
    at_rest_s = 2.0 * plant.damping / (2.0 * np.pi * plant.mode_hz)
    assert law_for(plant).advance_s == pytest.approx(plant.delay_s + at_rest_s, abs=0.06)


def test_a_tip_that_does_not_follow_teaches_nothing() -> None:
    sent = COURSE.wanted_m
    for tip in (np.zeros_like(sent), np.full_like(sent, 0.1), 0.4 - sent):
        with pytest.raises(LearningError, match="axes"):
            find_advance_s(sent, tip, STEP_S)


@given(st.floats(0.0, LONGEST_S), st.floats(0.5, 10.0), st.floats(0.05, 5.0))
def test_the_cutoff_stays_below_mode_waypoints_and_advance(
    advance_s: float, mode_hz: float, waypoint_step_s: float
) -> None:
    cutoff = cutoff_hz(advance_s, mode_hz, waypoint_step_s)
    assert 0.0 < cutoff < mode_hz
    assert cutoff * waypoint_step_s <= 0.25 + 1e-12
    assert cutoff * advance_s <= 1.0 / 3.0 + 1e-12

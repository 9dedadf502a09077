"""The observer: it finds what the model misses, and moves nothing when the camera goes or lies."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Response
from pneuarm.controllers.feedback.estimator import EstimateSource, Estimator
from pneuarm.controllers.feedback.observer import FeedbackSettings, TipObserver, Verdict
from pneuarm.controllers.geometry.rotations import rotation_from_vector
from pneuarm.controllers.kinematics.compiled import CompiledKinematics
from tools.rig.arms import paper_arm

ARM = paper_arm()
PERIOD_S, STILL_M = 2e-3, 1e-3
SETTINGS = FeedbackSettings(rate_max_m_s=0.1)
OFFSET_M = np.array([0.012, -0.004, 0.006])
TURN = rotation_from_vector(np.array([0.05, -0.02, 0.1]))


class Setup:
    """An observer, and an arm that is where the model says but for an offset and a turn."""

    def __init__(self) -> None:
        self.observer = TipObserver(ARM, SETTINGS, PERIOD_S, STILL_M)
        self.lengths = ARM.rest_lengths_m + np.array([[0.01, 0.0, -0.01]])
        tip = CompiledKinematics(ARM).evaluate(self.lengths)
        self.position, self.rotation = tip.position_m.copy(), tip.rotation.copy()
        self.largest_step = 0.0
        for _ in range(2000):
            self.observer.step(self.lengths)

    def run(self, seconds: float, offset_m: np.ndarray | None) -> list[Verdict]:
        verdicts = []
        for number in range(round(seconds / PERIOD_S)):
            if offset_m is not None and number % 5 == 0:
                position = self.position + offset_m
                verdicts.append(self.observer.measure(position, TURN @ self.rotation, 0.0))
            before = self.observer.offset_m.copy()
            self.observer.step(self.lengths)
            step = float(np.linalg.norm(self.observer.offset_m - before))
            self.largest_step = max(self.largest_step, step)
        return verdicts


def test_it_converges_to_offset_and_turn_and_never_faster_than_its_rate() -> None:
    setup = Setup()
    setup.run(6.0, OFFSET_M)
    assert setup.observer.offset_m == pytest.approx(OFFSET_M, abs=SETTINGS.deadband_m)
    assert setup.observer.rotation == pytest.approx(TURN, abs=1e-4)
    assert setup.largest_step <= SETTINGS.rate_max_m_s * PERIOD_S * (1 + 1e-9)


@given(st.floats(0.0, 0.3), st.floats(2e-3, 0.3), st.floats(0.0, 0.1), st.floats(5e-3, 0.2))
def test_it_is_never_faster_than_its_loop_allows(
    delay_s: float, lag_s: float, camera_late_s: float, camera_pause_s: float
) -> None:
    response = Response(delay_s=delay_s, filling_lag_s=0.5 * lag_s, exhausting_lag_s=lag_s)
    settings = replace(SETTINGS, delay_s=camera_late_s, timeout_s=1.0)
    observer = TipObserver(replace(ARM, response=response), settings, PERIOD_S, STILL_M)
    away_m = CompiledKinematics(ARM).evaluate(ARM.rest_lengths_m).position_m + OFFSET_M
    ticks = math.ceil(camera_pause_s / PERIOD_S)
    moved_m = []
    for tick in range(3 * ticks):
        before_m = observer.offset_m
        if tick % ticks == 0:
            observer.measure(away_m, np.eye(3), 0.0)
        observer.step(ARM.rest_lengths_m)
        left_m = np.linalg.norm(OFFSET_M - before_m)
        moved_m.append(np.linalg.norm(observer.offset_m - before_m) / left_m)
    loop_s = delay_s + lag_s + camera_late_s + camera_pause_s
    # Twice as fast where the tip stands still.
    assert max(moved_m[ticks + 1 :]) <= PERIOD_S / loop_s * (1.0 + 1e-9)


def test_a_lost_camera_freezes_the_offset_and_its_return_does_not_jump() -> None:
    setup = Setup()
    setup.run(6.0, OFFSET_M)
    sigma = setup.observer.sigma_m
    setup.run(SETTINGS.timeout_s + 2 * PERIOD_S, None)
    assert not setup.observer.seen
    frozen = setup.observer.offset_m.copy()
    setup.run(3.0, None)
    assert setup.observer.offset_m == pytest.approx(frozen, abs=0.0)
    assert setup.observer.sigma_m > 2 * sigma
    setup.largest_step = 0.0
    setup.run(3.0, OFFSET_M + np.array([0.01, 0.0, 0.0]))
    assert setup.observer.seen
    assert 0.0 < setup.largest_step <= SETTINGS.rate_max_m_s * PERIOD_S * (1 + 1e-9)
    assert setup.observer.offset_m[0] == pytest.approx(OFFSET_M[0] + 0.01, abs=2e-4)


def test_a_jump_is_refused_and_taken_when_it_lasts() -> None:
    setup = Setup()
    setup.run(4.0, OFFSET_M)
    kept = setup.observer.offset_m.copy()
    away = OFFSET_M + np.array([0.03, 0.0, 0.0])
    assert set(setup.run(0.05, away)) == {Verdict.REFUSED}
    assert setup.observer.offset_m == pytest.approx(kept, abs=SETTINGS.deadband_m)
    assert set(setup.run(0.3, OFFSET_M)) == {Verdict.TAKEN}
    verdicts = setup.run(SETTINGS.jump_accept_s + 0.1, away)
    assert verdicts[0] is Verdict.REFUSED
    assert verdicts.count(Verdict.ACCEPTED_ANEW) == 1
    assert verdicts[-1] is Verdict.TAKEN
    setup.run(4.0, away)
    assert setup.observer.offset_m == pytest.approx(away, abs=2 * SETTINGS.deadband_m)


def test_poses_that_jump_about_are_never_taken() -> None:
    setup = Setup()
    setup.run(2.0, OFFSET_M)
    for number in range(200):
        wrong = OFFSET_M + (0.05 if number % 2 else -0.05) * np.ones(3)
        assert setup.run(0.01, wrong) == [Verdict.REFUSED]


def test_a_pose_is_compared_with_the_prediction_of_its_own_time() -> None:
    observer = TipObserver(ARM, SETTINGS, PERIOD_S, STILL_M)
    history = []
    for number in range(1500):
        sway = 0.02 * np.sin(0.01 * number)
        observer.step(ARM.rest_lengths_m + np.array([[sway, 0.0, -sway]]))
        history.append(observer.prediction.ago(0.0)[0].copy())
        if number > 500 and number % 5 == 0:  # seen 10 ms, and a dead time of 5 ms, after
            position = 0.5 * history[-8] + 0.5 * history[-9]
            observer.measure(position, np.eye(3), 0.0)
    assert np.linalg.norm(observer.offset_m) < SETTINGS.deadband_m


def test_the_estimate_says_what_it_rests_on() -> None:
    setup, estimator = Setup(), Estimator(ARM)
    none = np.full((1, 3), np.nan)
    before = estimator.tip_estimate(setup.lengths, none, setup.observer)
    assert before.source == EstimateSource.PRESSURES
    assert before.sigma_m == SETTINGS.model_sigma_m
    sensed = estimator.tip_estimate(setup.lengths, setup.lengths, setup.observer)
    assert (sensed.source, sensed.sigma_m) == (EstimateSource.LENGTHS, SETTINGS.length_sigma_m)
    setup.run(3.0, OFFSET_M)
    seen = estimator.tip_estimate(setup.lengths, none, setup.observer)
    assert seen.source == EstimateSource.TIP_POSE
    assert seen.position_m == pytest.approx(setup.position + OFFSET_M, abs=1e-4)
    assert seen.sigma_m < 1e-3


def test_a_first_correction_larger_than_the_way_that_is_judged_is_believed() -> None:
    """The arm stands, and only the correction moves: no reason to doubt the camera."""
    setup = Setup()
    large = np.array([0.03, 0.0, 0.0])
    assert set(setup.run(6.0, large)) == {Verdict.TAKEN}
    assert setup.observer.offset_m == pytest.approx(large, abs=SETTINGS.deadband_m)

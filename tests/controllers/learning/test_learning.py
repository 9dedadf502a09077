"""Trial after trial: convergence, a trial that is undone, and the end where it diverges."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuarm.controllers.arm.errors import LearningDiverges, LearningError
from pneuarm.controllers.learning.learning import Learning
from tests.controllers.learning.plants import MODE_HZ, Plant, bow_course
from tests.controllers.learning.test_law import plants

COURSE = bow_course()
MIDDLE_M = np.array([0.0, 0.0, 0.2])


def learning(bound_m: float = 0.04) -> Learning:
    return Learning(COURSE, bound_m, MODE_HZ)


def run(plant: Plant, disturbance_m: np.ndarray, trials: int = 8) -> list[float]:
    """Errors (RMS, m) of the trials."""
    learnt = learning()
    for _ in range(trials):
        learnt.take(plant.tip(COURSE.wanted_m + learnt.offset_m, MIDDLE_M) + disturbance_m)
        assert np.linalg.norm(learnt.offset_m, axis=1).max() <= 0.04 + 1e-12
    return [trial.rms_m for trial in learnt.trials]


def droop(size_m: float, phase: float) -> np.ndarray:
    """A disturbance (n, 3) that comes again in every trial."""
    slow = np.sin(2.0 * np.pi * COURSE.times_s / COURSE.duration_s + phase)
    return size_m * np.outer(slow, [0.6, 0.0, 0.8])


@given(plants, st.floats(0.0, 0.008), st.floats(0.0, 6.28))
@settings(max_examples=60, deadline=None)
def test_the_error_becomes_smaller_and_stays_so(plant: Plant, size_m: float, phase: float) -> None:
    errors = run(plant, droop(size_m, phase))
    assert errors[-1] < 0.5 * errors[0] or errors[-1] < 5e-4
    for before, after in pairwise(errors):
        assert after < 1.02 * before + 2e-5


@given(plants)
@settings(max_examples=20, deadline=None)
def test_without_an_error_nothing_is_learnt(plant: Plant) -> None:
    learnt = learning()
    for _ in range(3):
        learnt.take(COURSE.wanted_m)
        assert not learnt.offset_m.any()
    assert not learnt.has_learnt


def test_a_worse_trial_is_undone_and_half_as_much_is_tried() -> None:
    learnt = learning()
    learnt.take(Plant(delay_s=0.1).tip(COURSE.wanted_m, MIDDLE_M))
    first = learnt.offset_m
    assert np.abs(first).max() > 1e-3
    learnt.take(COURSE.wanted_m - 0.03)  # somebody has pushed the arm
    # From the first trial, in which nothing was known: half of the step of then.
    np.testing.assert_allclose(learnt.offset_m, 0.5 * first, atol=1e-12)
    assert learnt.best is learnt.trials[0]
    learnt.take(COURSE.wanted_m + 1e-4)
    assert learnt.best is learnt.trials[2]
    assert learnt.trials.index(learnt.best) == 2
    np.testing.assert_allclose(learnt.best.offset_m, 0.5 * first, atol=1e-12)


def test_two_worse_trials_one_after_the_other_end_it() -> None:
    learnt = learning()
    learnt.take(Plant(delay_s=0.1).tip(COURSE.wanted_m, MIDDLE_M))
    worst = COURSE.wanted_m - 0.03
    learnt.take(worst)
    with pytest.raises(LearningDiverges) as told:
        learnt.take(worst)
    assert all(fact in str(told.value) for fact in ("52.0 mm", "arm.response", "calibrate"))
    assert learnt.best is learnt.trials[0]


def test_a_plant_that_answers_the_wrong_way_once_it_is_known_diverges_in_words() -> None:
    learnt = learning()
    learnt.take(Plant(delay_s=0.1).tip(COURSE.wanted_m, MIDDLE_M))

    def go_on() -> None:
        while len(learnt.trials) < 20:
            sent = COURSE.wanted_m - 6.0 * learnt.offset_m
            learnt.take(Plant(delay_s=0.1).tip(sent, MIDDLE_M))

    with pytest.raises(LearningDiverges):
        go_on()


def test_refusals_halve_the_step_and_the_second_in_a_row_is_the_last() -> None:
    learnt = learning()
    assert not learnt.refuse()  # of the wanted trajectory itself
    learnt.take(Plant(delay_s=0.1).tip(COURSE.wanted_m, MIDDLE_M))
    first = learnt.offset_m
    assert learnt.refuse()
    np.testing.assert_allclose(learnt.offset_m, 0.5 * first, atol=1e-12)
    assert not learnt.refuse()


def test_a_first_trial_that_did_not_follow_teaches_nothing() -> None:
    with pytest.raises(LearningError):
        learning().take(np.zeros_like(COURSE.wanted_m))

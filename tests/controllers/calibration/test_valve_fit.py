"""Dead time and lags of the valves are found; what does not show them is refused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Array, Response
from pneuarm.controllers.calibration.pace import Pace, pace_of
from pneuarm.controllers.calibration.plan import Move, gentle
from pneuarm.controllers.calibration.recording import Recording
from pneuarm.controllers.calibration.valve_fit import ValvesFit, fit_valves
from tests.controllers.calibration.synthetic import PAPER, delayed_and_lagged
from tools.rig.foreign_arms import sent_by

NOMINAL = Response()
NOISE_PA = 200.0


def staircase(rest_s: float, step_pa: float = 4e3) -> Array:
    """What is sent in the gentle part, each rest as long as is said."""
    moves = [Move(move.pressures_pa, 0.0, rest_s) for move in gentle(PAPER, step_pa / 0.8)]
    return sent_by(moves, 1)


def recording_of(sent_pa: Array, response: Response, noise_pa: float = NOISE_PA) -> Recording:
    """What sensors with noise see of such valves."""
    rng = np.random.default_rng(1)
    measured = delayed_and_lagged(sent_pa, response, finer=5)
    measured += noise_pa * rng.normal(0.0, 1.0, sent_pa.shape)
    return Recording(0.01 * np.arange(len(sent_pa)), sent_pa, measured, np.zeros((len(sent_pa), 3)))


def found(response: Response, rest_s: float) -> ValvesFit:
    return fit_valves(recording_of(staircase(rest_s), response), NOMINAL)


@given(
    filling_s=st.floats(0.05, 2.0),
    asymmetry=st.floats(1.0, 5.0),
    delay_s=st.floats(0.0, 0.3),
    empties_slower=st.booleans(),
)
@example(filling_s=0.06, asymmetry=1.0, delay_s=0.005, empties_slower=True)
@example(filling_s=0.2, asymmetry=3.0, delay_s=0.03, empties_slower=True)
@example(filling_s=0.45, asymmetry=1600 / 450, delay_s=0.06, empties_slower=True)
@settings(max_examples=12)
def test_small_steps_show_dead_time_filling_and_exhausting(
    filling_s: float, asymmetry: float, delay_s: float, empties_slower: bool
) -> None:
    exhausting_s = min(2.0, filling_s * asymmetry if empties_slower else filling_s / asymmetry)
    truth = Response(delay_s=delay_s, filling_lag_s=filling_s, exhausting_lag_s=exhausting_s)
    fitted = found(truth, rest_s=delay_s + 3.0 * max(filling_s, exhausting_s))
    assert fitted.why_not == ""
    assert fitted.response.delay_s == pytest.approx(delay_s, abs=0.01)
    assert fitted.response.filling_lag_s == pytest.approx(filling_s, rel=0.06, abs=0.01)
    assert fitted.response.exhausting_lag_s == pytest.approx(exhausting_s, rel=0.06, abs=0.01)
    kept = (fitted.response.mode_hz, fitted.response.damping_ratio)
    assert kept == (NOMINAL.mode_hz, NOMINAL.damping_ratio)


WELL = recording_of(staircase(1.5), Response(filling_lag_s=0.2, exhausting_lag_s=0.5))


@pytest.mark.parametrize(
    ("recording", "facts"),
    [
        (replace(WELL, measured_pa=np.full_like(WELL.sent_pa, np.nan)), ("no pressures",)),
        (replace(WELL, sent_pa=np.zeros_like(WELL.sent_pa)), ("hardly changed",)),
        (
            recording_of(np.minimum.accumulate(-staircase(1.5, 1e4)), NOMINAL),
            ("filled", "0.06 bar"),
        ),
        (recording_of(np.maximum.accumulate(staircase(1.5, 1e4)), NOMINAL), ("exhausted", "bar")),
        (replace(WELL, measured_pa=WELL.measured_pa[::-1]), ()),
        (recording_of(staircase(1.5), Response(delay_s=0.8)), ("delay_ms", "bound")),
        (replace(WELL, measured_pa=0.4 * WELL.measured_pa), ("%",)),
    ],
    ids=["unmeasured", "still", "never filled", "never emptied", "other", "late", "half"],
)
def test_what_does_not_show_the_valves_is_refused_by_name(
    recording: Recording, facts: tuple[str, ...]
) -> None:
    why = fit_valves(recording, NOMINAL).why_not
    assert why
    assert [fact for fact in facts if fact not in why] == []


def test_what_noise_leaves_unsure_is_not_believed() -> None:
    noisy = recording_of(
        staircase(0.3, 6e3), Response(filling_lag_s=1.0, exhausting_lag_s=1.0), 2e3
    )
    assert fit_valves(noisy, NOMINAL).why_not


@given(
    filling_s=st.floats(0.02, 2.0), exhausting_s=st.floats(0.02, 2.0), delay_s=st.floats(0.0, 0.3)
)
@settings(max_examples=20)
def test_at_its_pace_no_pressure_is_as_far_from_the_expected_one_as_a_fault(
    filling_s: float, exhausting_s: float, delay_s: float
) -> None:
    response = Response(delay_s=delay_s, filling_lag_s=filling_s, exhausting_lag_s=exhausting_s)
    pace = pace_of(NOMINAL, response, 1e4)
    for sign in (1.0, -1.0):
        end = np.full((1, 3), sign * min(pace.step_pa, 5e4))
        ramp = np.full((1, 3), sign * 5e4)
        moves = [
            Move(end, 0.0, 5.0 * max(filling_s, exhausting_s)),
            Move(end + ramp, max(pace.ramp_s(ramp), 0.7), 0.5),
        ]
        sent = sent_by(moves, 1)
        real, expected = (delayed_and_lagged(sent, each, 5) for each in (response, NOMINAL))
        assert np.abs(real - expected).max() < 0.8e4


def test_valves_that_are_as_expected_may_go_at_any_pace() -> None:
    pace = pace_of(NOMINAL, NOMINAL, 1e4)
    assert pace.ramp_s(np.full((1, 3), 1e5)) < 0.1
    assert pace.step_pa > 1e6
    assert Pace().ramp_s(np.full((1, 3), 1e5)) == 0.0

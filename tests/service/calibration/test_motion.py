"""Valves that nobody has measured: their gentle steps, and a pace at which no monitor speaks."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from pneuarm.controllers.arm.errors import CalibrationError
from pneuarm.controllers.calibration.pace import Pace
from pneuarm.controllers.calibration.plan import KNOWN, LONGEST_REST_S, Move, plan
from pneuarm.controllers.calibration.recording import Recording
from pneuarm.controllers.calibration.valve_fit import fit_valves
from pneuarm.hardware.simulator.pneumatics import Valve
from pneuarm.service.calibration.motion import Pacer, first_moves, pace_after
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.monitors.monitors import Lag
from pneuarm.service.monitors.pressure_deviates import PressureDeviates
from pneuarm.service.monitors.sensor_frozen import SensorFrozen
from tests.service.monitors.test_monitors import WELL
from tools.bench.responses import ROWS, arm_of, times_to_63_s, valves_of

STEP_S, FINER, NOISE_PA = 0.01, 4, 200.0


class Watched:
    """Valves, the pressures measured behind them, and the monitors that look at them."""

    def __init__(self, configuration: Configuration, valve: Valve) -> None:
        arm, keys = configuration.build_arm(), configuration.monitors.keys_of_monitors()
        self.valve, self._lag, self._pacer = valve, Lag(arm.response), Pacer(configuration)
        self._monitors = [
            kind(arm, keys[kind.fault.code])  # type: ignore[arg-type]
            for kind in (PressureDeviates, SensorFrozen)
        ]
        self._rng, self.rows = (
            np.random.default_rng(0),
            list[tuple[float, np.ndarray, np.ndarray]](),
        )
        self.said, self.longest_s, self._time_s = "", 0.0, 0.0
        self.at_pa = np.zeros(valve.pressures_pa.shape)

    def go(self, moves: list[Move]) -> None:
        for move in moves:
            begun_s, first = self._time_s, len(self.rows)
            self._pacer.begin(move)
            while True:
                elapsed_s = self._pacer.elapsed_s
                if len(self.rows) % 10 == 0 and move.over(elapsed_s, partial(self._newest, first)):
                    break
                self._step(move.at(self.at_pa, elapsed_s))
            self.longest_s = max(self.longest_s, self._time_s - begun_s - move.ramp_s)
            self.at_pa = move.pressures_pa

    def _newest(self, first: int, seconds: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        newest = self.rows[max(first, len(self.rows) - round(seconds / STEP_S)) :]
        measured = np.array([row[2] for row in newest])
        return np.array([row[0] for row in newest]), measured, np.full((len(newest), 3), np.nan)

    def _step(self, sent_pa: np.ndarray) -> None:
        self.valve.command(sent_pa, self._time_s)
        for _ in range(FINER):
            self.valve.advance(self._time_s, self._time_s + STEP_S / FINER)
            self._time_s += STEP_S / FINER
        measured = self.valve.pressures_pa + self._rng.normal(0.0, NOISE_PA, sent_pa.shape)
        sent, seen = sent_pa.reshape(-1).tolist(), measured.reshape(-1).tolist()
        self._pacer.see(self._time_s, sent, seen)
        self._pacer.go_on(STEP_S)
        look = replace(
            WELL,
            now_s=self._time_s,
            measured_pa=seen,
            sent_pa=sent,
            expected_pa=self._lag.advance(sent, seen, STEP_S),
        )
        for monitor in self._monitors:
            self.said = self.said or monitor.look(look)
        self.rows.append((self._time_s, sent_pa.copy(), measured))

    @property
    def recording(self) -> Recording:
        times, sent, measured = (np.array(column) for column in zip(*self.rows, strict=True))
        return Recording(times, sent, measured, np.full((len(times), 3), np.nan))


def gently(row: str) -> tuple[Configuration, Watched, Pace]:
    """The gentle part of a calibration of valves; the configuration expects those of `servo`."""
    configuration, device = arm_of(row, "paper", 0)
    valve = valves_of(row, configuration.build_arm(), device)
    watched = Watched(configuration, valve)
    watched.go(first_moves(configuration)[0])
    return configuration, watched, pace_after(configuration, watched.recording)


@pytest.mark.parametrize("row", ROWS)
def test_whatever_the_valves_are_no_monitor_speaks_and_they_are_found(row: str) -> None:
    configuration, watched, pace = gently(row)
    arm = configuration.build_arm()
    found = fit_valves(watched.recording, arm.response)
    assert found.why_not == ""
    if "/" in row:
        told_ms = [float(part) for part in row.split("/")]
        response = found.response
        seen_s = (response.filling_lag_s, response.exhausting_lag_s, response.delay_s)
        for value_s, true_ms in zip(seen_s, told_ms, strict=True):
            assert 1e3 * value_s == pytest.approx(true_ms, rel=0.08, abs=10.0)
    moves = plan(arm, pace)
    watched.go([*moves[:4], *moves[-3:]])  # up, down to nothing, and the steps
    assert watched.said == ""
    assert watched.longest_s <= LONGEST_REST_S + 0.1


def test_at_full_pace_a_monitor_would_have_spoken() -> None:
    configuration, watched, _ = gently("450/1600/60")
    watched.go(plan(configuration.build_arm(), KNOWN)[-3:])
    assert "bar was expected" in watched.said


def test_a_ramp_waits_for_a_chamber_that_is_slower_than_it_seemed_but_not_for_ever() -> None:
    configuration, watched, _ = gently("450/1600/60")
    watched.go(plan(configuration.build_arm(), KNOWN)[:4])
    assert watched.said == ""
    pacer, stuck = Pacer(configuration), Move(np.full((1, 3), 5e4), 1.0, 0.0)
    pacer.begin(stuck)
    for number in range(round((LONGEST_REST_S + 2.0) / STEP_S)):
        pacer.see(number * STEP_S, [2e4] * 3, [0.0] * 3)
        pacer.go_on(STEP_S)
        if number == round(5.0 / STEP_S):
            assert pacer.elapsed_s < 0.2
    assert pacer.elapsed_s >= stuck.ramp_s


def test_the_times_of_slow_valves_are_those_of_their_lags() -> None:
    configuration, device = arm_of("450/1600/60", "paper", 0)
    valve = valves_of("450/1600/60", configuration.build_arm(), device)
    assert times_to_63_s(valve, 1e4) == pytest.approx((0.51, 1.66), abs=0.01)


def test_a_chamber_that_does_not_follow_is_named() -> None:
    configuration, watched, _ = gently("60/60/5")
    whole = watched.recording
    measured = whole.measured_pa * [1.0, 0.1, 1.0]
    with pytest.raises(CalibrationError, match=r"chamber 2 .*valve"):
        pace_after(configuration, replace(whole, measured_pa=measured))
    unmeasured = replace(whole, measured_pa=np.full_like(measured, np.nan))
    assert pace_after(configuration, unmeasured).ramp_s(np.full((1, 3), 1e5)) < 0.1

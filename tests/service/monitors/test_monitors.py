"""Each monitor alone, at its threshold and at its persistence."""

import math
from collections.abc import Callable
from dataclasses import replace
from math import exp, inf, nan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm, Response
from pneuarm.controllers.kinematics.compiled import CompiledKinematics
from pneuarm.hardware.interface import Measurement
from pneuarm.service.configuration.tables.monitors import MonitorsConfig
from pneuarm.service.modes.mode import Mode
from pneuarm.service.monitors.device import DeviceComplains, StopPressed
from pneuarm.service.monitors.estimate_diverges import EstimateDiverges
from pneuarm.service.monitors.leak import SETTLED_S, Leak
from pneuarm.service.monitors.loop_overruns import LoopOverruns
from pneuarm.service.monitors.measurement_age import (
    DeviceLost,
    MeasurementOld,
    measurement_age_s,
)
from pneuarm.service.monitors.model_contradicted import OLDEST_S, ModelContradicted, TipModel
from pneuarm.service.monitors.monitor import Monitor, Observation, Persistence, bar, chamber
from pneuarm.service.monitors.monitors import MONITORS, Lag, Monitors
from pneuarm.service.monitors.overpressure import Overpressure
from pneuarm.service.monitors.pressure_deviates import LAG_UNCERTAINTY, PressureDeviates
from pneuarm.service.monitors.sensor_frozen import SensorFrozen
from pneuarm.service.monitors.sensor_invalid import SensorInvalid
from pneuarm.service.monitors.setpoint_foreign import SetpointForeign
from pneuarm.service.monitors.supply_low import SupplyLow
from tools.rig.arms import paper_arm, table1_arm

ARM = paper_arm()
HIGH, LOW = ARM.sections[0].pressure_max_pa, ARM.sections[0].pressure_min_pa
LASTING_S, DT_S = 0.1, 0.01
LASTING = {"lasting_ms": 100.0}

WELL = Observation(
    now_s=0.0,
    dt_s=DT_S,
    mode=Mode.ACTIVE,
    vented=False,
    measured_pa=[1e4, 2e4, 3e4],
    sent_pa=[1e4, 2e4, 3e4],
    expected_pa=[1e4, 2e4, 3e4],
    age_s=0.0,
    supply_pa=nan,
    setpoints_pa=None,
    lengths_m=[nan, nan, nan],
    estimated_m=[0.2, 0.2, 0.2],
    tip_error_m=nan,
    overruns=0,
    complaints=(),
    stop_pressed=False,
)


def made(kind: type[Monitor], arm: Arm = ARM, **keys: float) -> Monitor:
    """A monitor with some of its keys."""
    return kind(arm, kind.keys(**keys))


def deviates(vent_timeout_s: float = 1.0) -> Monitor:
    return made(PressureDeviates, deviation_bar=0.1, vent_timeout_s=vent_timeout_s, **LASTING)


def contradicted(arm: Arm = ARM) -> Monitor:
    percent = 5.0 / arm.total_rest_length_m  # 50 mm
    return made(
        ModelContradicted,
        arm,
        length_tolerance_mm=20.0,
        tip_tolerance_percent=percent,
        **LASTING,
    )


def told_after(monitor: Monitor, seen: Observation, seconds: float = 1.0) -> float:
    """Time from the beginning of something to the first word about it; infinite if none comes."""
    for number in range(round(seconds / DT_S) + 1):
        if monitor.look(replace(seen, now_s=number * DT_S)):
            return number * DT_S
    return inf


@pytest.mark.parametrize(
    ("make", "well", "ill", "facts"),
    [
        (
            deviates,
            {"measured_pa": [1e4, 2e4 + 1e4, 3e4]},
            {"measured_pa": [1e4, 2e4 - 1e4 - 1.0, 3e4]},
            ("section 1, chamber 2", "0.100 bar", "0.200 bar"),
        ),
        (
            lambda: made(Overpressure, margin_bar=0.1, **LASTING),
            {"measured_pa": [HIGH + 1e4, 0.0, LOW - 1e5]},
            {"measured_pa": [0.0, 0.0, HIGH + 1e4 + 1.0]},
            ("section 1, chamber 3", bar(HIGH + 1e4)),
        ),
        (
            lambda: made(SensorInvalid, margin_bar=0.1, **LASTING),
            {"measured_pa": [HIGH + 1e4, LOW - 1e4, 0.0]},
            {"measured_pa": [HIGH + 1e4 + 1.0, 0.0, 0.0]},
            ("section 1, chamber 1", bar(HIGH + 1e4)),
        ),
        (
            lambda: made(SensorInvalid, margin_bar=0.1, **LASTING),
            {},
            {"measured_pa": [0.0, nan, 0.0]},
            ("section 1, chamber 2", "nan"),
        ),
        (
            lambda: made(SupplyLow, margin_bar=(1.1e5 - HIGH) / 1e5, **LASTING),
            {"supply_pa": 1.1e5},
            {"supply_pa": 1.1e5 - 1.0},
            ("supply", "1.100 bar"),
        ),
        (
            contradicted,
            {"tip_error_m": 0.05},
            {"tip_error_m": 0.0501},
            ("tip", "50 mm", "allowed: 50"),
        ),
        (
            lambda: made(EstimateDiverges, margin_mm=10.0, **LASTING),
            {"estimated_m": [0.0901, 0.2, 0.3099]},
            {"estimated_m": [0.2, 0.3101, 0.2]},
            ("section 1, chamber 2", "310 mm", "90 to 310 mm"),
        ),
        (
            lambda: made(EstimateDiverges, margin_mm=10.0, **LASTING),
            {},
            {"estimated_m": [nan, 0.2, 0.2]},
            ("section 1, chamber 1", "nan"),
        ),
        (
            lambda: made(SetpointForeign, deviation_bar=0.01, **LASTING),
            {"setpoints_pa": [1.1e4, 1.9e4, 3e4]},
            {"setpoints_pa": [1.1e4 + 1.0, 2e4, 3e4]},
            ("section 1, chamber 1", "0.110 bar", "0.100 bar"),
        ),
    ],
)
def test_beyond_its_threshold_and_after_its_persistence(
    make: Callable[[], Monitor],
    well: dict[str, object],
    ill: dict[str, object],
    facts: tuple[str, ...],
) -> None:
    assert told_after(make(), replace(WELL, **well)) == inf  # type: ignore[arg-type]
    sick = replace(WELL, **ill)  # type: ignore[arg-type]
    assert told_after(make(), sick) == pytest.approx(LASTING_S + DT_S)
    monitor = make()
    told_after(monitor, sick)
    told = monitor.look(replace(sick, now_s=1.0))
    assert [fact for fact in facts if fact not in told] == []
    assert monitor.look(replace(WELL, now_s=1.01)) == ""
    assert monitor.look(replace(sick, now_s=1.02)) == ""  # it has to last anew


def test_lasting_is_without_a_break_and_longer_than() -> None:
    lasting = Persistence()
    assert [lasting.longer(True, t, 1.0) for t in (0.0, 0.9, 1.0, 1.01)] == [False] * 3 + [True]
    assert not lasting.longer(False, 1.1, 1.0)
    assert [lasting.longer(True, t, 1.0) for t in (1.2, 2.0, 2.3)] == [False, False, True]
    assert not Persistence().longer(True, 5.0, 0.0)


def test_chambers_are_counted_from_one_and_pressures_told_in_bar() -> None:
    assert [chamber(i) for i in (0, 2, 3)] == [
        "section 1, chamber 1",
        "section 1, chamber 3",
        "section 2, chamber 1",
    ]
    assert bar(12345.6) == "0.123 bar"


# --- the pressure follows ----------------------------------------------------------------------


def test_the_lag_is_of_first_order_and_exact_for_any_step() -> None:
    response = Response(delay_s=0.0)
    lag, coarse = Lag(response), Lag(response)
    lag.advance([0.0], [500.0], 0.0)
    coarse.advance([0.0], [500.0], 0.0)
    for _ in range(60):
        fine = lag.advance([1e5], [0.0], 1e-3)
    assert fine == pytest.approx(coarse.advance([1e5], [0.0], 0.06))
    assert fine == pytest.approx([1e5 + exp(-1.0) * (500.0 - 1e5)])
    assert Lag(response).advance([7.0, 7.0], [nan, 3.0], 1.0) == [0.0, 3.0]


@pytest.mark.parametrize("step_s", [1e-3, 4e-3, 0.05])
def test_a_command_acts_after_the_dead_time_however_long_a_step_is(step_s: float) -> None:
    lag = Lag(Response(delay_s=0.005))
    lag.advance([0.0], [0.0], 0.0)
    for index in range(round(0.2 / step_s)):
        expected = lag.advance([1e5], [0.0], step_s)
        passed_s = (index + 1) * step_s - 0.005
        assert expected == pytest.approx([1e5 * (1.0 - exp(-max(0.0, passed_s) / 0.06))])


def test_without_a_lag_the_pressure_is_there_when_the_dead_time_is_over() -> None:
    lag = Lag(Response(delay_s=0.005, filling_lag_s=0.0, exhausting_lag_s=0.0))
    lag.advance([0.0], [0.0], 0.0)
    assert lag.advance([1e5], [0.0], 0.004) == [0.0]
    assert lag.advance([2e5], [0.0], 0.004) == [1e5]
    assert lag.advance([2e5], [0.0], 0.004) == [2e5]


@pytest.mark.parametrize(("sent_pa", "lag_s"), [(1e5, 0.4), (-1e5, 1.6)])
def test_a_pressure_is_expected_by_the_lag_of_its_direction(sent_pa: float, lag_s: float) -> None:
    lag = Lag(Response(delay_s=0.0, filling_lag_s=0.4, exhausting_lag_s=1.6))
    lag.advance([sent_pa, 0.0], [0.0, 0.0], 0.0)
    for number in range(1, 300):
        expected, still = lag.advance([sent_pa, 0.0], [0.0, 0.0], 0.01)
        assert expected == pytest.approx(sent_pa * (1.0 - exp(-0.01 * number / lag_s)))
        assert still == 0.0


@given(
    filling_s=st.floats(0.05, 2.0),
    ratio=st.floats(0.2, 5.0),
    delay_s=st.floats(0.0, 0.3),
    seed=st.integers(0, 99),
)
@settings(max_examples=20)
def test_valves_that_answer_as_is_expected_of_them_never_deviate(
    filling_s: float, ratio: float, delay_s: float, seed: int
) -> None:
    response = Response(
        delay_s=delay_s, filling_lag_s=filling_s, exhausting_lag_s=ratio * filling_s
    )
    levels = np.random.default_rng(seed).uniform(-8e4, 8e4, 4).repeat(100)
    times_s = DT_S * np.arange(len(levels))
    monitor, lag, pressure = deviates(), Lag(response), 0.0
    for now_s, level in zip(times_s.tolist(), levels.tolist(), strict=True):
        seen = replace(WELL, now_s=now_s, measured_pa=[pressure], sent_pa=[level])
        assert not monitor.look(replace(seen, expected_pa=lag.advance([level], [0.0], DT_S)))
        for fine_s in now_s + DT_S / 10 * np.arange(10):  # Euler's: no formula of the code
            late = float(levels[int(max(fine_s - delay_s, 0.0) / DT_S)])
            slow_s = response.filling_lag_s if late > pressure else response.exhausting_lag_s
            pressure += DT_S / 10 * (late - pressure) / slow_s


@pytest.mark.parametrize(("sent_pa", "lag_s"), [(8e4, 0.4), (-8e4, 1.6)])
def test_a_stuck_valve_is_told_as_soon_as_the_lag_of_its_direction_allows(
    sent_pa: float, lag_s: float
) -> None:
    monitor = deviates()
    lag = Lag(Response(delay_s=0.0, filling_lag_s=0.4, exhausting_lag_s=1.6))
    stuck = replace(WELL, measured_pa=[0.0], sent_pa=[sent_pa])
    for number in range(500):
        expected = lag.advance([sent_pa], [0.0], DT_S)
        if monitor.look(replace(stuck, now_s=DT_S * number, expected_pa=expected)):
            break
    # 0.1 bar and half of what is still to go of 0.8 bar: when 0.3333 bar are expected.
    due_s = -lag_s * math.log(1.0 - 0.3333 / 0.8) + LASTING_S
    assert DT_S * number == pytest.approx(due_s, abs=3 * DT_S)


def test_in_a_move_the_lag_may_be_wrong_by_its_uncertainty() -> None:
    to_go_pa = 4e4
    allowed_pa = 1e4 + LAG_UNCERTAINTY * to_go_pa
    moving = replace(WELL, sent_pa=[1e4 + to_go_pa, 2e4, 3e4])
    for off_pa, expected in ((allowed_pa - 1.0, inf), (allowed_pa + 1.0, LASTING_S + DT_S)):
        seen = replace(moving, measured_pa=[1e4 - off_pa, 2e4, 3e4])
        assert told_after(deviates(), seen) == pytest.approx(expected)


def test_a_vented_chamber_has_longer_but_a_fault_does_not_go_by_venting() -> None:
    full = replace(WELL, measured_pa=[5e4, 0.0, 0.0], sent_pa=[0.0] * 3, expected_pa=[0.0] * 3)
    vented = replace(full, vented=True, mode=Mode.IDLE)
    assert told_after(deviates(0.5), vented) == pytest.approx(0.5 + DT_S)
    monitor = deviates(0.5)
    told_after(monitor, full)
    assert monitor.look(replace(vented, now_s=LASTING_S + 2 * DT_S))


# --- the others --------------------------------------------------------------------------------


def leak_of_3_kpa() -> Monitor:
    return made(Leak, lost_bar=0.03, **LASTING)


def held(monitor: Monitor, pressures_pa: Callable[[float], list[float]], seconds: float) -> float:
    """Hold for some time; return when the leak is told, from the end of the settling."""
    for number in range(round(seconds / DT_S)):
        now_s = number * DT_S
        seen = replace(WELL, now_s=now_s, mode=Mode.HOLD, measured_pa=pressures_pa(now_s))
        if monitor.look(seen):
            return now_s - SETTLED_S
    return inf


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_held_pressure_that_falls_is_a_leak_and_one_that_rises_is_none(sign: float) -> None:
    def falling(now_s: float) -> list[float]:
        return [0.0, sign * (5e4 - 1e4 * now_s), 0.0]

    def rising(now_s: float) -> list[float]:
        return [0.0, sign * (5e4 + 1e4 * now_s), 0.0]

    # 3000 Pa are lost after 0.3 s, and that must last.
    assert held(leak_of_3_kpa(), falling, 5.0) == pytest.approx(0.4, abs=0.05)
    assert held(leak_of_3_kpa(), rising, 5.0) == inf


def test_what_settles_after_the_hold_begins_is_no_leak_nor_is_noise() -> None:
    rng = np.random.default_rng(0)

    def settling(now_s: float) -> list[float]:
        noise = rng.normal(0.0, 240.0, 3)
        return (5e4 + 2e4 * exp(-now_s / 0.072) + noise).tolist()

    assert held(leak_of_3_kpa(), settling, 60.0) == inf


def test_a_leak_is_looked_for_only_while_holding_and_anew_in_every_hold() -> None:
    leak = leak_of_3_kpa()
    falling = [replace(WELL, now_s=t * DT_S, measured_pa=[5e4 - 2e2 * t] * 3) for t in range(200)]
    assert not any(leak.look(seen) for seen in falling)
    assert held(leak, lambda now_s: [2e4] * 3, 3.0) == inf
    leak.look(WELL)
    assert held(leak, lambda now_s: [1e4] * 3, 3.0) == inf  # another hold, another start
    assert held(leak_of_3_kpa(), lambda now_s: [2e3 - 4e3 * now_s] * 3, 3.0) == inf


def test_a_reading_is_frozen_only_when_its_command_moves() -> None:
    frozen = made(SensorFrozen, moved_bar=0.05, **LASTING)
    assert told_after(frozen, WELL, 100.0) == inf  # the same to the bit for 100 s
    moved = replace(WELL, expected_pa=[1e4, 2e4, 3e4 + 5e3])
    assert told_after(frozen, moved) == inf
    moved = replace(WELL, expected_pa=[1e4, 2e4 - 5e3 - 1.0, 3e4])
    assert told_after(frozen, moved) == pytest.approx(LASTING_S + DT_S)
    told = frozen.look(replace(moved, now_s=2.0))
    assert all(fact in told for fact in ("section 1, chamber 2", "0.200 bar", "0.050 bar"))
    one_bit = [1e4, math.nextafter(2e4, inf), 3e4]
    assert frozen.look(replace(moved, now_s=2.1, measured_pa=one_bit)) == ""
    assert told_after(frozen, replace(moved, measured_pa=one_bit)) == inf


def test_a_slow_and_coarse_sensor_is_not_frozen() -> None:
    frozen = made(SensorFrozen, moved_bar=0.05, **LASTING)
    for number in range(2000):  # 1 kHz, the device answers at 50 Hz in whole millibars
        true = 4e4 * math.sin(2.0 * math.pi * 0.5 * number * 1e-3)
        device = 4e4 * math.sin(2.0 * math.pi * 0.5 * (number - number % 20) * 1e-3)
        seen = replace(
            WELL,
            now_s=number * 1e-3,
            measured_pa=[100.0 * round(device / 100.0)] * 3,
            expected_pa=[true] * 3,
        )
        assert frozen.look(seen) == ""


def test_lengths_are_compared_with_the_map_of_their_pressures() -> None:
    for arm in (paper_arm(), table1_arm()):
        pressures = np.array([[1e4, 2e4, 3e4]])
        lengths = PressureMap(arm).lengths_m(pressures)
        for off_m, expected in ((0.0199, inf), (-0.0201, LASTING_S + DT_S)):
            seen = replace(WELL, lengths_m=[*lengths[0, :2].tolist(), float(lengths[0, 2]) + off_m])
            monitor = contradicted(arm)
            assert told_after(monitor, seen) == pytest.approx(expected)
    assert "section 1, chamber 3" in monitor.look(replace(seen, now_s=9.0))
    some = replace(WELL, lengths_m=[nan, 0.4, nan])  # one sensor only
    assert told_after(contradicted(), some) < inf


@pytest.mark.parametrize("noise_m", [0.0, 1e-4])
def test_a_length_that_stands_still_while_its_pressures_move_is_told(noise_m: float) -> None:
    """Also where it is never far from the model's: it stands in the middle of small moves."""
    pressure_map, rng = PressureMap(ARM), np.random.default_rng(0)
    still = contradicted()
    told: dict[float, str] = {}
    for share in (0.0, 1.0):  # of the motion, that the third sensor shows: first none
        for number in range(400):
            pressures = 2e4 + 6e3 * np.sin(0.05 * number + np.array([[0.0, 2.0, 4.0]]))
            lengths = pressure_map.lengths_m(pressures)
            stands = pressure_map.lengths_m(np.full((1, 3), 2e4))[0, 2]
            lengths[0, 2] = stands + share * (lengths[0, 2] - stands)
            lengths += rng.normal(0.0, noise_m, lengths.shape) if noise_m else 0.0
            seen = replace(
                WELL,
                now_s=number * DT_S + 10.0 * share,
                measured_pa=pressures[0].tolist(),
                lengths_m=lengths[0].tolist(),
            )
            told[share] = still.look(seen)
    assert all(fact in told[0.0] for fact in ("section 1, chamber 3", "stands"))
    assert told[1.0] == ""


def test_a_length_that_stands_while_nothing_moves_is_well() -> None:
    lengths = PressureMap(ARM).lengths_m(np.array([[1e4, 2e4, 3e4]]))[0].tolist()
    still = contradicted()
    assert told_after(still, replace(WELL, lengths_m=lengths), 5.0) == inf
    assert told_after(still, replace(WELL, lengths_m=[nan, lengths[1], nan]), 5.0) == inf


@pytest.mark.parametrize("kind", [MeasurementOld, DeviceLost])
def test_the_age_is_its_own_persistence(kind: type[Monitor]) -> None:
    age = made(kind, oldest_ms=150.0)
    assert age.look(replace(WELL, age_s=0.15)) == ""
    told = age.look(replace(WELL, age_s=0.151))
    assert all(fact in told for fact in ("151 ms", "150 ms"))
    assert age.look(replace(WELL, age_s=-1.0)) == ""


@pytest.mark.parametrize(("missed", "told"), [(5, False), (6, True)])
def test_overruns_are_a_fraction_of_a_second(missed: int, told: bool) -> None:
    overruns = made(LoopOverruns, missed_percent=5.0)
    words = ""
    for number in range(101):
        words = overruns.look(
            replace(WELL, now_s=number * DT_S, overruns=100 + missed * (number > 50))
        )
    assert bool(words) == told
    if told:
        assert all(fact in words for fact in ("6", "107", "missed"))
        for number in range(101, 202):
            words = overruns.look(replace(WELL, now_s=number * DT_S, overruns=106))
        assert words == ""


def test_a_setpoint_between_our_command_and_its_lagged_value_is_ours() -> None:
    moving = replace(WELL, sent_pa=[5e4] * 3, expected_pa=[1e4] * 3)
    for setpoint_pa, expected in ((1e4 - 999.0, inf), (5e4 + 999.0, inf), (3e4, inf), (nan, inf)):
        seen = replace(moving, setpoints_pa=[setpoint_pa] * 3)
        assert told_after(made(SetpointForeign, deviation_bar=0.01, **LASTING), seen) == expected
    for setpoint_pa in (1e4 - 1001.0, 5e4 + 1001.0):
        seen = replace(moving, setpoints_pa=[setpoint_pa] * 3)
        assert told_after(made(SetpointForeign, deviation_bar=0.01, **LASTING), seen) < inf


def test_what_the_device_says_is_passed_on_at_once() -> None:
    assert made(DeviceComplains).look(replace(WELL, complaints=("hot", "low"))) == "hot; low"
    assert (made(DeviceComplains).look(WELL), made(StopPressed).look(WELL)) == ("", "")
    assert made(StopPressed).look(replace(WELL, stop_pressed=True))


def test_the_tip_is_compared_once_a_measurement_and_forgotten_when_old() -> None:
    model = TipModel(ARM)
    pressures = np.array([[1e4, 2e4, 3e4]])
    tip = CompiledKinematics(ARM).evaluate(PressureMap(ARM).lengths_m(pressures))
    measured = tip.position_m + np.array([0.0, 0.03, 0.04])
    assert model.error_m(measured, 10, pressures, 10) == pytest.approx(0.05)
    later = 10 + int(OLDEST_S * 1e9)
    assert model.error_m(measured, 10, 0.0 * pressures, later) == pytest.approx(0.05)
    assert math.isnan(model.error_m(measured, 10, pressures, later + 1000))
    assert model.error_m(measured, 20, 0.0 * pressures, 20) > 0.051


# --- all of them -------------------------------------------------------------------------------


@pytest.mark.parametrize("age_s", [0.0, 1.0])
def test_an_old_measurement_is_told_and_compared_with_nothing(age_s: float) -> None:
    monitors = Monitors(ARM, MonitorsConfig().keys_of_monitors())
    nonsense = Measurement(np.full((1, 3), nan), np.full((1, 3), nan), taken_s=10.0)
    for number in range(100):
        found = monitors.look(
            replace(nonsense, taken_s=10.0 + number * DT_S - age_s),
            np.zeros((1, 3)),
            ARM.rest_lengths_m,
            nan,
            Mode.ACTIVE,
            10.0 + number * DT_S,
            DT_S,
            0,
        )
    assert {fault.code for fault in found} == ({"measurement_old"} if age_s else {"sensor_invalid"})


def test_every_monitor_has_its_keys_by_the_code_of_its_fault() -> None:
    tables = MonitorsConfig().keys_of_monitors()
    assert {kind.fault.code: kind.keys for kind in MONITORS if kind.keys.model_fields} == {
        code: type(table) for code, table in tables.items()
    }
    assert all(kind.looks_at for kind in MONITORS)


@pytest.mark.parametrize("stamp_s", [nan, inf, 1.8e9, 1.5, -inf])
def test_a_stamp_of_another_clock_is_never_new(stamp_s: float) -> None:
    """As of an adapter that takes the time of day: what it measured once would be new for ever."""
    measurement = Measurement(np.zeros((1, 3)), np.full((1, 3), nan), taken_s=10.0 + stamp_s)
    assert measurement_age_s(measurement, 10.0) >= 1.0


def test_what_was_taken_while_the_tick_was_due_is_new() -> None:
    measurement = Measurement(np.zeros((1, 3)), np.full((1, 3), nan), taken_s=10.05)
    assert measurement_age_s(measurement, 10.0) == 0.0

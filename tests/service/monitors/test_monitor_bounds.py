"""What the monitors look for by default, at what is just within and just beyond, and what else."""

import math
import re
from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest
from pydantic import ValidationError

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm, Response
from pneuarm.hardware.interface import Measurement
from pneuarm.hardware.tables.table import Table
from pneuarm.service.configuration.tables.monitors import MonitorsConfig
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.monitors.device import DeviceComplains, StopPressed
from pneuarm.service.monitors.estimate_diverges import EstimateDiverges
from pneuarm.service.monitors.fault import Policy
from pneuarm.service.monitors.leak import Leak
from pneuarm.service.monitors.loop_overruns import LoopOverruns, LoopOverrunsKeys
from pneuarm.service.monitors.measurement_age import (
    DeviceLost,
    DeviceLostKeys,
    MeasurementOld,
    MeasurementOldKeys,
    measurement_age_s,
)
from pneuarm.service.monitors.model_contradicted import ModelContradicted, TipModel
from pneuarm.service.monitors.monitor import Monitor, Observation
from pneuarm.service.monitors.monitors import MONITORS, Lag, Monitors
from pneuarm.service.monitors.overpressure import Overpressure, OverpressureKeys
from pneuarm.service.monitors.pressure_deviates import PressureDeviates
from pneuarm.service.monitors.sensor_frozen import SensorFrozen
from pneuarm.service.monitors.sensor_invalid import SensorInvalid
from pneuarm.service.monitors.setpoint_foreign import SetpointForeign
from pneuarm.service.monitors.supply_low import SupplyLow
from tests.service.monitors.test_monitors import ARM, DT_S, HIGH, LOW, WELL, made
from tools.rig.arms import trunk_arm

#: Lengths of the model at the pressures of WELL.
MODEL_M = PressureMap(ARM).lengths_m(np.array([WELL.measured_pa])).ravel().tolist()


def told_after(monitor: Monitor, seen: Observation, seconds: float = 10.0) -> float:
    """Time from when all was well until something is told; infinite if nothing is."""
    assert not monitor.look(WELL)
    for number in range(1, round(seconds / DT_S)):
        if monitor.look(replace(seen, now_s=number * DT_S)):
            return (number - 1) * DT_S
    return inf


BY_DEFAULT: list[tuple[type[Monitor], dict[str, object], dict[str, object], float]] = [
    (MeasurementOld, {"age_s": 0.149}, {"age_s": 0.151}, 0.0),
    (DeviceLost, {"age_s": 0.999}, {"age_s": 1.001}, 0.0),
    (
        Overpressure,
        {"measured_pa": [HIGH + 14.9e3, 0.0, 0.0]},
        {"measured_pa": [HIGH + 15.1e3, 0.0, 0.0]},
        0.02,
    ),
    (
        SensorInvalid,
        {"measured_pa": [HIGH + 9.99e4, LOW - 9.99e4, 0.0]},
        {"measured_pa": [LOW - 1.001e5, 0.0, 0.0]},
        0.05,
    ),
    (
        SensorFrozen,
        {"expected_pa": [1e4 + 4.9e3, 2e4, 3e4]},
        {"expected_pa": [1e4 + 5.1e3, 2e4, 3e4]},
        0.2,
    ),
    (
        PressureDeviates,
        {"measured_pa": [1e4 + 9.9e3, 2e4, 3e4]},
        {"measured_pa": [1e4 + 10.1e3, 2e4, 3e4]},
        0.3,
    ),
    (
        PressureDeviates,
        {"measured_pa": [1e4 + 9.9e3, 2e4, 3e4], "vented": True},
        {"measured_pa": [1e4 + 10.1e3, 2e4, 3e4], "vented": True},
        3.0,
    ),
    (
        SetpointForeign,
        {"setpoints_pa": [1e4 + 2.9e3, 2e4, 3e4]},
        {"setpoints_pa": [1e4 + 3.1e3, 2e4, 3e4]},
        0.5,
    ),
    (SupplyLow, {"supply_pa": HIGH + 20.1e3}, {"supply_pa": HIGH + 19.9e3}, 0.5),
    (
        EstimateDiverges,
        {"estimated_m": [0.0701, 0.2, 0.3299]},
        {"estimated_m": [0.0699, 0.2, 0.2]},
        0.1,
    ),
    (ModelContradicted, {"tip_error_m": 0.1499}, {"tip_error_m": 0.1501}, 0.5),
    (
        ModelContradicted,
        {"lengths_m": [MODEL_M[0] + 0.0599, *MODEL_M[1:]]},
        {"lengths_m": [MODEL_M[0] + 0.0601, *MODEL_M[1:]]},
        0.5,
    ),
]


@pytest.mark.parametrize(
    ("kind", "well", "ill", "lasting_s"),
    BY_DEFAULT,
    ids=[f"{row[0].fault.code}-{number}" for number, row in enumerate(BY_DEFAULT)],
)
def test_what_a_monitor_looks_for_by_default_and_for_how_long(
    kind: type[Monitor], well: dict[str, object], ill: dict[str, object], lasting_s: float
) -> None:
    assert told_after(made(kind), replace(WELL, **well)) == inf  # type: ignore[arg-type]
    sick = replace(WELL, **ill)  # type: ignore[arg-type]
    assert told_after(made(kind), sick) == pytest.approx(lasting_s, abs=1.5 * DT_S)


@pytest.mark.parametrize(
    ("keys", "name", "allowed", "refused"),
    [
        (MeasurementOldKeys, "oldest_ms", (10.0, 10000.0), (9.9, 10000.1)),
        (DeviceLostKeys, "oldest_ms", (10.0, 10000.0), (9.9, 10000.1)),
        (OverpressureKeys, "lasting_ms", (0.0, 10000.0), (-0.1, 10000.1)),
        (LoopOverrunsKeys, "missed_percent", (0.1, 100.0), (0.0, 100.1)),
    ],
)
def test_a_key_has_its_range(
    keys: type[Table], name: str, allowed: tuple[float, ...], refused: tuple[float, ...]
) -> None:
    for value in allowed:
        assert getattr(keys(**{name: value}), name) == value
    for value in refused:
        with pytest.raises(ValidationError, match=name):
            keys(**{name: value})


def test_every_monitor_says_what_it_looks_at_and_how_to_set_it() -> None:
    assert all(kind.looks_at and kind.how_to_set for kind in MONITORS)


def test_the_policies_are_in_the_order_of_what_they_do() -> None:
    names = [policy.name for policy in sorted(Policy)]
    assert names == ["WARN", "HOLD", "RAMP", "VENT", "STOP"]


@pytest.mark.parametrize(
    "kind",
    [EstimateDiverges, Leak, ModelContradicted, Overpressure, PressureDeviates, SensorFrozen],
    ids=lambda kind: kind.fault.code,
)
def test_chambers_that_are_missing_are_not_passed_over(kind: type[Monitor]) -> None:
    """Two values of three chambers come from a mistake, and the third chamber may burst."""
    monitor, short = made(kind), {"mode": Mode.HOLD, "lengths_m": MODEL_M}
    monitor.look(replace(WELL, **short))  # type: ignore[arg-type]
    short["lengths_m"] = MODEL_M[:2]
    if kind is not ModelContradicted:
        short |= {"measured_pa": WELL.measured_pa[:2], "estimated_m": WELL.estimated_m[:2]}
    with pytest.raises(ValueError, match="zip"):
        monitor.look(replace(WELL, **short))  # type: ignore[arg-type]


def test_sections_have_bounds_of_their_own() -> None:
    arm = trunk_arm()
    weak = replace(arm.sections[0], pressure_max_pa=5e4, pressure_min_pa=-1e4)
    strong = replace(arm.sections[1], pressure_max_pa=8e4, pressure_min_pa=-8e4)
    arm = replace(arm, sections=(weak, strong))
    of_six = replace(
        WELL, **{name: [0.0] * 6 for name in ("measured_pa", "sent_pa", "expected_pa")}
    )
    supply, invalid = made(SupplyLow, arm, lasting_ms=0.0), made(SensorInvalid, arm, lasting_ms=0.0)
    over = made(Overpressure, arm, lasting_ms=0.0)
    for now_s, supply_pa, told in ((1.0, 9.99e4, False), (1.1, 9.99e4, True), (1.2, 1.01e5, False)):
        assert bool(supply.look(replace(of_six, now_s=now_s, supply_pa=supply_pa))) is told
    for reading_pa, told in ((1.79e5, False), (1.81e5, True), (-1.79e5, False), (-1.81e5, True)):
        seen = replace(of_six, measured_pa=[reading_pa, *[0.0] * 5])
        invalid.look(of_six)
        invalid.look(seen)
        assert bool(invalid.look(replace(seen, now_s=0.1))) is told
    seen = replace(of_six, measured_pa=[6.6e4, *[0.0] * 5])
    over.look(seen)
    assert "section 1, chamber 1" in over.look(replace(seen, now_s=0.1))
    seen = replace(of_six, measured_pa=[*[0.0] * 3, 6.6e4, 0.0, 0.0])
    assert over.look(replace(seen, now_s=0.2)) == ""


# --- pressures ----------------------------------------------------------------------------------


def test_a_command_that_is_given_back_is_expected_back() -> None:
    lag = Lag(Response(delay_s=0.0, filling_lag_s=0.1, exhausting_lag_s=0.1))
    lag.advance([0.0], [0.0], 0.01)
    for _ in range(200):
        lag.advance([1e4], [0.0], 0.01)
    for _ in range(200):
        expected = lag.advance([0.0], [0.0], 0.01)
    assert expected == pytest.approx([0.0], abs=1e-3)


def test_without_a_lag_a_command_acts_after_its_dead_time_and_not_at_its_end() -> None:
    lag = Lag(Response(delay_s=0.25, filling_lag_s=0.0, exhausting_lag_s=0.0))
    lag.advance([0.0], [0.0], 0.0)
    assert lag.advance([1e4], [0.0], 0.25) == [0.0]
    assert lag.advance([1e4], [0.0], 0.25) == [1e4]


def test_a_pressure_that_comes_down_may_be_late_too() -> None:
    falling = replace(WELL, sent_pa=[1e4 - 4e4, 2e4, 3e4])
    for off_pa, expected in ((2.99e4, inf), (3.01e4, 0.3)):
        seen = replace(falling, measured_pa=[1e4 + off_pa, 2e4, 3e4])
        assert told_after(made(PressureDeviates), seen) == pytest.approx(expected, abs=0.015)


def test_what_was_never_acknowledged_counts_as_zero() -> None:
    monitors = Monitors(ARM, MonitorsConfig().keys_of_monitors())
    never, zeros = np.full((1, 3), nan), np.zeros((1, 3))
    for pressure_pa, told in ((0.0, False), (2e4, True)):
        for number in range(100):
            now_s = 10.0 + number * DT_S
            measured = Measurement(np.full((1, 3), pressure_pa), never, taken_s=now_s)
            found = monitors.look(
                measured, never, ARM.rest_lengths_m, nan, Mode.ACTIVE, now_s, DT_S, 0
            )
        assert ("pressure_deviates" in {fault.code for fault in found}) is told
    seen = replace(measured, setpoints_pa=zeros)
    arguments = (never, ARM.rest_lengths_m, nan, Mode.ACTIVE, now_s, DT_S, 0)
    assert "setpoint_foreign" not in {fault.code for fault in monitors.look(seen, *arguments)}


@pytest.mark.parametrize(
    ("sent_pa", "measured_pa"), [(2e4, 2e4), (nan, -1e4)], ids=["sent", "never sent"]
)
def test_a_pressure_is_compared_with_the_one_that_was_sent(
    sent_pa: float, measured_pa: float
) -> None:
    monitors = Monitors(ARM, MonitorsConfig().keys_of_monitors())
    for number in range(200):
        now_s = 10.0 + number * DT_S
        measured = Measurement(np.full((1, 3), measured_pa), np.full((1, 3), nan), taken_s=now_s)
        sent = np.full((1, 3), sent_pa)
        found = monitors.look(measured, sent, ARM.rest_lengths_m, nan, Mode.ACTIVE, now_s, DT_S, 0)
        assert "pressure_deviates" not in {fault.code for fault in found}


def test_setpoints_supply_lengths_and_tip_are_looked_at_in_every_tick() -> None:
    monitors = Monitors(ARM, MonitorsConfig().keys_of_monitors())
    zeros = np.zeros((1, 3))
    for number in range(100):
        now_s = 10.0 + number * DT_S
        measured = Measurement(
            zeros,
            np.full((1, 3), 0.29),
            taken_s=now_s,
            supply_pa=1e4,
            setpoints_pa=zeros + 1e4,
            complaints=("hot",),
            stop_pressed=True,
        )
        estimated = np.full((1, 3), 0.5)
        found = monitors.look(
            measured, zeros, estimated, 1.0, Mode.ACTIVE, now_s, DT_S, 99 * number
        )
    assert {fault.code for fault in found} == {
        "stop_pressed",
        "device_complains",
        "setpoint_foreign",
        "supply_low",
        "estimate_diverges",
        "model_contradicted",
    }
    assert all(found.values())


def test_what_does_not_depend_on_the_measurement_is_told_beside_an_old_one() -> None:
    monitors = Monitors(ARM, MonitorsConfig().keys_of_monitors())
    zeros = np.zeros((1, 3))
    measured = Measurement(zeros, zeros + 0.2, taken_s=8.0, complaints=("hot",), stop_pressed=True)
    for number in range(102):
        now_s = 10.0 + number * DT_S
        found = monitors.look(
            measured, zeros, ARM.rest_lengths_m, nan, Mode.ACTIVE, now_s, DT_S, 9 * number
        )
    assert {fault.code for fault in found} == {
        "stop_pressed",
        "device_lost",
        "measurement_old",
        "loop_overruns",
        "device_complains",
    }


@pytest.mark.parametrize(("mode", "told"), [(Mode.ACTIVE, True), (Mode.READY, False)])
def test_a_vented_mode_has_the_longer_time_to_empty(mode: Mode, told: bool) -> None:
    monitors = Monitors(ARM, MonitorsConfig().keys_of_monitors())
    zeros = np.zeros((1, 3))
    for number in range(100):
        now_s = 10.0 + number * DT_S
        pressures = zeros if number == 0 else zeros + 2e4
        measured = Measurement(pressures, np.full((1, 3), nan), taken_s=now_s)
        found = monitors.look(measured, zeros, ARM.rest_lengths_m, nan, mode, now_s, DT_S, 0)
    assert ("pressure_deviates" in {fault.code for fault in found}) is told


def test_a_frozen_reading_tells_how_far_its_command_moved_down() -> None:
    frozen = made(SensorFrozen)
    moved = replace(WELL, expected_pa=[4e3, 2e4, 3e4])
    told_after(frozen, moved)
    told = frozen.look(replace(moved, now_s=9.0))
    assert all(fact in told for fact in ("section 1, chamber 1", "0.100 bar", " 0.060 bar"))


def test_an_estimate_at_the_end_of_what_is_allowed_is_well() -> None:
    at_ends = replace(WELL, estimated_m=[0.1 - 10.0 * 1e-3, 0.2, 0.3 + 10.0 * 1e-3])
    assert told_after(made(EstimateDiverges, margin_mm=10.0), at_ends) == inf


def test_a_command_for_fewer_chambers_than_were_measured_is_a_mistake() -> None:
    lag = Lag(Response())
    lag.advance([0.0, 0.0], [0.0, 0.0, 0.0], DT_S)
    with pytest.raises(ValueError, match="zip"):
        lag.advance([0.0, 0.0], [0.0, 0.0, 0.0], DT_S)


def test_what_a_monitor_has_looked_at_stays_as_it_was() -> None:
    frozen, first = made(SensorFrozen), replace(WELL, measured_pa=[1e4] * 3, expected_pa=[2e4] * 3)
    frozen.look(first)
    frozen.look(replace(first, measured_pa=[5e4] * 3, expected_pa=[6e4] * 3))
    assert (first.measured_pa, first.expected_pa) == ([1e4] * 3, [2e4] * 3)


# --- the leak -----------------------------------------------------------------------------------


def leak_after(
    monitor: Monitor, pressures_pa: list[tuple[float, list[float]]], seconds: float = 10.0
) -> float:
    """Hold; a pressure is there from its time on. Return when a leak is told."""
    for number in range(round(seconds / DT_S)):
        now_s = number * DT_S
        newest = [pressure for since_s, pressure in pressures_pa if since_s <= now_s][-1]
        if monitor.look(replace(WELL, now_s=now_s, mode=Mode.HOLD, measured_pa=newest)):
            return now_s
    return inf


def test_what_a_chamber_loses_at_once_is_told_when_the_filter_has_seen_it() -> None:
    held, less, little = [5e4, 0.0, 0.0], [4.6e4, 0.0, 0.0], [4.72e4, 0.0, 0.0]
    # 3 of 4 kPa after 0.2 s ln 4, for 0.3 s.
    expected_s = 2.0 + 0.2 * math.log(4.0) + 0.3
    assert leak_after(made(Leak), [(0.0, held), (2.0, less)]) == pytest.approx(expected_s, abs=0.02)
    assert leak_after(made(Leak), [(0.0, held), (2.0, little)]) == inf


def test_what_settles_for_eight_tenths_of_a_second_is_where_the_hold_starts() -> None:
    before, after = [5e4, 0.0, 0.0], [4e4, 0.0, 0.0]
    assert leak_after(made(Leak), [(0.0, before), (0.02, after)]) == inf
    assert leak_after(made(Leak), [(0.0, before), (0.75, after)]) < 2.0


def test_a_loss_or_a_pressure_of_just_what_may_be_lost_is_no_leak() -> None:
    for held_pa, left_pa, told in (
        (5e4, 4.7e4, False),
        (5e4, 4.6999e4, True),
        (3e3, -1e3, False),
        (3.001e3, -1e3, True),
        (-3e3, 1e3, False),
    ):
        pressures = [(0.0, [held_pa, 0.0, 0.0]), (1.0, [left_pa, 0.0, 0.0])]
        assert (leak_after(made(Leak), pressures, 20.0) < inf) is told


def test_the_filter_of_a_slow_loop_comes_to_rest_on_the_bound_itself() -> None:
    for left_pa, told in ((4.7e4, False), (4.6999e4, True)):
        leak = made(Leak)
        for number in range(60):
            measured = [5e4 if number < 5 else left_pa, 0.0, 0.0]
            seen = replace(WELL, mode=Mode.HOLD, dt_s=1.0, now_s=float(number))
            what = leak.look(replace(seen, measured_pa=measured))
        assert bool(what) is told


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_smallest_loss_that_may_be_asked_for_is_seen(sign: float) -> None:
    leak = made(Leak, lost_bar=1e-6)
    assert leak_after(leak, [(0.0, [sign * 0.5, 0.0, 0.0]), (1.0, [0.0] * 3)]) < inf


def test_a_loop_that_stalls_as_the_hold_begins_starts_from_what_it_sees_then() -> None:
    leak = made(Leak)
    assert leak_after(leak, [(0.0, [8e4, 0.0, 0.0])], 2.0) == inf
    leak.look(replace(WELL, now_s=2.0))
    hold = replace(WELL, mode=Mode.HOLD, now_s=4.0, dt_s=2.0)
    assert leak.look(replace(hold, measured_pa=[5e4, 0.0, 0.0])) == ""
    for number in range(100):
        seen = replace(hold, now_s=4.0 + number * DT_S, dt_s=DT_S)
        assert leak.look(replace(seen, measured_pa=[5e4, 0.0, 0.0])) == ""
    for number in range(300):
        seen = replace(hold, now_s=5.0 + number * DT_S, dt_s=DT_S)
        told = leak.look(replace(seen, measured_pa=[4e4, 0.0, 0.0]))
    assert all(fact in told for fact in ("section 1, chamber 1", "0.500 bar", "0.400 bar"))


# --- ages, overruns, lengths and the tip --------------------------------------------------------


def measured_at(taken_s: float | None) -> Measurement:
    return Measurement(np.zeros((1, 3)), np.full((1, 3), nan), taken_s=taken_s)


@pytest.mark.parametrize(
    ("taken_s", "age_s"),
    [(None, 0.0), (-0.3, 0.3), (-3.0, 3.0), (0.0, 0.0), (0.05, 0.0), (0.1, 0.0), (0.15, 0.15)],
)
def test_the_age_of_a_measurement(taken_s: float | None, age_s: float) -> None:
    assert measurement_age_s(measured_at(taken_s), 0.0) == pytest.approx(age_s)


def test_every_second_is_counted_by_itself_and_stays_said_for_the_next() -> None:
    monitor, overruns = made(LoopOverruns), 0
    told = []
    for number in range(351):
        if number in (50, 250):
            overruns += 6
        told.append(monitor.look(replace(WELL, now_s=50.0 + number * DT_S, overruns=overruns)))
    assert not any(told[:100])
    assert all("6 of 107" in said for said in told[100:200])
    assert not any(told[200:300])
    assert all("6 of 106" in said for said in told[300:])


def test_a_share_of_deadlines_that_is_just_allowed_is_not_told() -> None:
    monitor = made(LoopOverruns)
    for number in range(95):
        told = monitor.look(replace(WELL, now_s=number / 94.0, overruns=5 * (number == 94)))
    assert told == ""


def test_a_length_is_told_with_how_far_it_is_off() -> None:
    rest = replace(WELL, measured_pa=[0.0] * 3)
    monitor = made(ModelContradicted, length_tolerance_mm=20.0)
    short = replace(rest, lengths_m=[nan, 0.15, nan])
    told_after(monitor, short)
    told = monitor.look(replace(short, now_s=9.0))
    facts = ("section 1, chamber 2", " 150 mm", " 50 mm", "20")
    assert [fact for fact in facts if fact not in told] == []
    twice = made(ModelContradicted, length_tolerance_mm=200.0)
    assert told_after(twice, replace(rest, lengths_m=[0.4, nan, nan])) == inf
    assert told_after(twice, replace(rest, lengths_m=[0.4001, nan, nan])) < inf


def test_the_lengths_of_every_section_are_compared() -> None:
    arm: Arm = trunk_arm()
    monitor = made(ModelContradicted, arm, lasting_ms=0.0)
    lengths = PressureMap(arm).lengths_m(np.zeros((3, 3))).ravel().tolist()
    seen = replace(WELL, measured_pa=[0.0] * 9, lengths_m=[*lengths[:8], lengths[8] + 0.07])
    monitor.look(seen)
    assert "section 3, chamber 3" in monitor.look(replace(seen, now_s=0.1))


def test_a_tip_counts_for_a_fifth_of_a_second_whenever_it_came() -> None:
    pressures, far = np.zeros((1, 3)), np.array([1.0, 0.0, 0.2])
    for received_ns in (0, 1, 10**18):
        model = TipModel(ARM)
        error_m = model.error_m(far, received_ns, pressures, received_ns + 190_000_000)
        assert error_m == pytest.approx(1.0)
        assert math.isnan(model.error_m(far, received_ns, pressures, received_ns + 210_000_000))


def test_the_device_is_looked_at_as_it_is() -> None:
    assert made(StopPressed).look(replace(WELL, stop_pressed=True, age_s=5.0))
    assert made(DeviceComplains).look(replace(WELL, complaints=("hot",), age_s=5.0)) == "hot"


def test_an_impossible_estimate_is_told_with_its_chamber_in_millimetres() -> None:
    lengths_m = [*MODEL_M]
    lengths_m[1] = 0.412
    monitor, what = made(EstimateDiverges, margin_mm=10.0), ""
    for number in range(1, round(10.0 / DT_S)):
        what = what or monitor.look(replace(WELL, estimated_m=lengths_m, now_s=number * DT_S))
    assert "chamber 2" in what
    numbers = [int(number) for number in re.findall(r"-?\d+", what)]
    assert 412 in numbers
    assert min(numbers) > 0
    assert {90, 310} <= set(numbers)  # Eq. (4)'s interval with the margin


def test_the_policies_bring_about_what_they_say() -> None:
    events = [None, ModeEvent.FAULT_HOLD, ModeEvent.FAULT, ModeEvent.FAULT, ModeEvent.ESTOP]
    assert [policy.event for policy in sorted(Policy)] == events
    assert len({policy.consequence for policy in Policy}) == len(events)

"""Faults in the whole loop: the ramp down, the latch, the reset, and what is told when."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.controllers.targets.targets import PressuresTarget
from pneuarm.logs.rings.status import Disk
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.processes.pipe import SetTipPose
from pneuarm.service.safety.faults import FAULTS
from tests.service.control.wild import assert_writes_within_limits_and_slew
from tools.faults.breakages import (
    always,
    bench_of,
    failing,
    follow,
    frozen_sensor,
    silent_device,
)
from tools.rig.faulty import Faulty
from tools.rig.simulated import Bench


def moving() -> tuple[Bench, Faulty]:
    bench, faulty = bench_of("paper", 0)
    bench.activate()
    follow(bench, 1.0)
    return bench, faulty


def ramping() -> tuple[Bench, Faulty]:
    bench, faulty = moving()
    follow(bench, 2.0, until=lambda: bench.newest["pressure_measured_pa"][0, 0] > 4e4)
    frozen_sensor(bench, faulty)
    follow(bench, 2.0, until=lambda: bench.mode == Mode.FAULT)
    assert bench.codes()[-1] == "sensor_frozen"
    assert np.abs(bench.newest["pressure_sent_pa"]).max() > 2e4
    return bench, faulty


def test_a_ramp_goes_down_in_proportion_at_its_rate_and_then_vents() -> None:
    bench, _ = ramping()
    start = bench.newest["pressure_sent_pa"].copy()
    vents, begun_s, before = len(bench.hardware.vents), bench.now_s, start
    while len(bench.hardware.vents) == vents:
        bench.tick()
        sent = bench.newest["pressure_sent_pa"]
        assert (np.abs(sent) <= np.abs(before) + 1e-9).all()
        assert (np.abs(sent - before) <= 1.001e5 * 4e-3).all()
        if len(bench.hardware.vents) == vents:
            np.testing.assert_allclose(sent / sent[0, 0], start / start[0, 0], rtol=1e-9)
        before = sent.copy()
    assert bench.now_s - begun_s == pytest.approx(np.abs(start).max() / 1e5, abs=0.01)
    assert not bench.newest["pressure_sent_pa"].any()
    assert bench.mode == Mode.FAULT
    assert_writes_within_limits_and_slew(bench)


def test_the_ramp_is_never_faster_than_the_slew() -> None:
    bench, _ = moving()
    slew = 0.5e5
    sections = tuple(
        type(section)(**{**vars(section), "pressure_slew_max_pa_s": slew})
        for section in bench.arm.sections
    )
    slow = type(bench.arm)("slow", sections, bench.arm.gravity_m_s2)
    safety = type(bench.loop._safety)(slow, bench.configuration.monitors, bench.loop._modes)
    assert safety._ramp_pa_s == slew


@pytest.mark.parametrize("how", ["stop", "overpressure", "exception"])
def test_what_is_worse_cuts_the_ramp_short(how: str) -> None:
    bench, faulty = ramping()
    bench.run(0.05)
    writes = len(bench.hardware.writes)
    if how == "stop":
        assert bench.ask(ModeEvent.ESTOP).accepted
    elif how == "exception":
        failing(RuntimeError("no"))(bench, faulty)
        bench.tick()
    else:
        always(pressures_pa=np.full((1, 3), 1.5e5))(bench, faulty)
        bench.run_until(lambda: bench.codes()[-1] == "overpressure", 0.1)
        writes = max(writes, len(bench.hardware.writes))
    assert not bench.newest["pressure_sent_pa"].any()
    bench.run(0.1)
    assert len(bench.hardware.writes) == writes
    assert bench.mode == (Mode.ESTOP if how == "stop" else Mode.FAULT)


def test_reset_waits_for_the_ramp_and_for_the_cause() -> None:
    bench, faulty = ramping()
    refused = bench.ask(ModeEvent.RESET)
    assert not refused.accepted
    assert "ramp" in refused.reason
    assert "zero" in refused.reason
    bench.run(1.5)
    refused = bench.ask(ModeEvent.RESET)
    assert not refused.accepted
    assert "sensor_frozen" in refused.reason
    assert "section 1, chamber 1" in refused.reason
    assert FAULTS["sensor_frozen"].remedy in refused.reason
    assert bench.codes()[-1] == "mode_refused"
    enable = bench.ask(ModeEvent.ENABLE)
    assert "reset" in enable.reason
    assert "sensor_frozen" in enable.reason
    faulty.alter = None
    bench.tick()
    assert bench.mode == Mode.FAULT  # latched: the cause alone frees nothing
    assert bench.ask(ModeEvent.RESET).accepted
    bench.run_until(lambda: bench.mode == Mode.READY, 2.0)
    assert bench.ask(ModeEvent.ENABLE).accepted


def test_a_fault_while_ready_blocks_enabling_with_its_reason() -> None:
    bench, faulty = bench_of("paper", 0)
    bench.get_ready()
    always(supply_pa=0.5e5)(bench, faulty)
    bench.run(0.6)
    assert (bench.mode, bench.codes()[-1]) == (Mode.READY, "supply_low")
    refused = bench.ask(ModeEvent.ENABLE)
    assert not refused.accepted
    assert "supply_low" in refused.reason
    assert "0.500 bar" in refused.reason
    faulty.alter = None
    bench.tick()
    assert bench.ask(ModeEvent.ENABLE).accepted


@pytest.mark.parametrize("mode", [Mode.IDLE, Mode.READY])
def test_a_fault_while_vented_latches_and_does_not_flood(mode: Mode) -> None:
    bench, faulty = bench_of("paper", 0)
    if mode == Mode.READY:
        bench.get_ready()
    else:
        bench.disk = Disk.STARTING
        bench.tick()
    assert bench.mode == mode
    failing(HardwareError("no answer"))(bench, faulty)
    events = len(bench.events)
    bench.run(11.0)
    assert bench.mode == Mode.FAULT
    assert [event.code for event in bench.events[events:]] == ["device_lost"]
    assert not bench.ask(ModeEvent.ENABLE).accepted


def test_a_fault_that_flickers_does_not_flood() -> None:
    bench, faulty = moving()
    lost = failing(HardwareError("a loose plug"))
    for _ in range(500):
        lost(bench, faulty)
        bench.tick()
        faulty.alter = None
        bench.tick()
    assert bench.mode == Mode.FAULT
    assert bench.codes().count("device_lost") == 1


def test_a_warning_is_repeated_while_it_lasts_but_seldom() -> None:
    bench, faulty = moving()
    always(complaints=("undervoltage",))(bench, faulty)
    follow(bench, 11.0)
    assert bench.mode == Mode.ACTIVE
    assert bench.codes().count("device_complains") == 2
    assert bench.events[-1].cause == "undervoltage"
    assert bench.ask(ModeEvent.HOLD).accepted
    assert bench.ask(ModeEvent.ENABLE).accepted  # a warning blocks nothing


@pytest.mark.parametrize("mode", [Mode.ESTOP, Mode.FAULT])
def test_a_device_that_fails_in_a_latched_mode_is_told_and_blocks_the_reset(mode: Mode) -> None:
    bench, faulty = moving()
    if mode == Mode.ESTOP:
        bench.ask(ModeEvent.ESTOP)
    else:
        failing(RuntimeError("first"))(bench, faulty)
        bench.tick()
    assert bench.mode == mode
    events = len(bench.events)
    failing(HardwareError("the cable is out"))(bench, faulty)
    bench.run(1.0)
    assert [event.code for event in bench.events[events:]] == ["device_lost"]
    assert (bench.events[-1].mode, bench.mode) == (mode, mode)
    assert "the cable is out" in bench.events[-1].cause
    assert "device_lost" in bench.ask(ModeEvent.RESET).reason
    faulty.alter = None
    bench.run(0.5)
    assert bench.ask(ModeEvent.RESET).accepted


def test_the_stop_input_stops_in_its_tick_and_is_reset_only_when_released() -> None:
    bench, faulty = moving()
    always(stop_pressed=True)(bench, faulty)
    vents = len(bench.hardware.vents)
    bench.tick()
    assert (bench.mode, bench.newest["mode"]) == (Mode.ESTOP, Mode.ESTOP)
    assert len(bench.hardware.vents) == vents + 1
    refused = bench.ask(ModeEvent.RESET)
    assert "stop_pressed" in refused.reason
    faulty.alter = None
    bench.tick()
    assert bench.ask(ModeEvent.RESET).accepted


def test_a_silent_device_holds_first_and_is_lost_then() -> None:
    bench, faulty = moving()
    silent_device(bench, faulty)
    follow(bench, 0.3)
    assert (bench.mode, bench.codes()[-1]) == (Mode.HOLD, "measurement_old")
    assert "measurement_old" in bench.ask(ModeEvent.ENABLE).reason
    bench.run(1.0)
    assert (bench.mode, bench.codes()[-1]) == (Mode.FAULT, "device_lost")
    assert not bench.newest["pressure_sent_pa"].any()
    assert bench.newest["measurement_age_s"] > 1.0


def test_after_a_failed_reading_age_and_supply_are_unknown() -> None:
    bench, faulty = moving()
    assert bench.newest["supply_pa"] == 2e5
    failing(OSError("gone"))(bench, faulty)
    bench.tick()
    assert np.isnan(bench.newest["supply_pa"])
    assert np.isnan(bench.newest["measurement_age_s"])
    assert int(bench.newest["active_faults"]) == 1 << FAULTS["device_lost"].bit


def test_an_old_tip_pose_contradicts_nothing() -> None:
    bench, _ = moving()
    far = np.array([2.0, 0.0, 0.0])
    bench.tick(SetTipPose(far, np.array([0.0, 0.0, 0.0, 1.0]), bench.now_ns))
    follow(bench, 1.0)
    assert "model_contradicted" not in bench.codes()


def test_air_that_stays_in_a_vented_arm_is_a_fault() -> None:
    bench, faulty = moving()
    bench.ask(ModeEvent.VENT)
    faulty.alter = lambda measurement, time_s: replace(
        measurement, pressures_pa=measurement.pressures_pa + np.array([0.4e5, 0.0, 0.0])
    )
    bench.run(2.5)
    assert bench.mode == Mode.IDLE
    bench.run(1.0)
    assert (bench.mode, bench.codes()[-1]) == (Mode.FAULT, "pressure_deviates")
    assert re.search(r"section 1, chamber 1\b.*\b0\.(39|40)", bench.events[-1].cause)


def test_the_guards_work_is_counted_by_kind(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench().activate()
    rubbish = np.array([[1e9, np.nan, 0.0]])
    monkeypatch.setattr(bench.loop._steering._controller, "pressures_pa", lambda: rubbish)
    bench.run(0.01)
    newest = bench.newest
    assert newest["guard_interventions"] == 5
    counts = [int(newest[f"guard_{kind}"]) for kind in ("range", "slew", "not_finite")]
    assert counts == [5, 5, 5]
    assert (newest["guard_too_old"], newest["guard_supply"]) == (0, 0)


def test_a_limited_supply_slows_the_whole_arm_together() -> None:
    bench = Bench(supply_flow_max_bar_s=1.0).activate()
    start = len(bench.records)
    bench.run(0.2, PressuresTarget(np.array([[0.8e5, 0.4e5, 0.0]])))
    sent = bench.ticks()[start:]["pressure_sent_pa"].reshape(-1, 3)
    rises = np.maximum(np.diff(sent, axis=0), 0.0).sum(axis=1)
    assert rises.max() <= 1e5 * 2e-3 * (1 + 1e-9)
    assert bench.newest["guard_supply"] > 50
    assert (sent[-1][:2] > 2e3).all()

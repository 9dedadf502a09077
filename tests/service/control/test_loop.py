"""The loop in simulated time: what a target does, what a tick writes down, what it survives."""

import numpy as np
import pytest

from pneuarm.controllers.limits.length import LengthLimit
from pneuarm.controllers.limits.pressure import PressureLimit
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.targets.targets import (
    LawName,
    LengthsTarget,
    PositionTarget,
    PressuresTarget,
    Target,
    TwistTarget,
)
from pneuarm.hardware.guard import Intervention
from pneuarm.logs.rings.status import Disk
from pneuarm.logs.rings.tick import tick_dtype
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.control.loop import Timing
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.processes.pipe import Heartbeat, RequestMode, SetTipPose
from tools.rig.simulated import START_NS, START_UNIX_NS, Bench, true_tip

NEAR = PositionTarget(np.array([0.05, 0.02, 0.2]))


def distance_m(bench: Bench, target: PositionTarget) -> float:
    return float(np.linalg.norm(bench.newest["tip_commanded_position_m"] - target.position_m))


@pytest.mark.parametrize("law", [LawName.RESOLVED_RATE, LawName.QP_IK])
def test_a_position_within_reach_is_reached(law: LawName) -> None:
    bench = Bench().activate()
    target = PositionTarget(NEAR.position_m, law)
    assert bench.run(0.05, target)["reach"] == Reach.MOVING
    start = true_tip(bench.ticks()[0])
    tick = bench.run(2.0, target)
    assert tick["reach"] == Reach.REACHED
    assert tick["target_error_m"] < 5e-4
    assert distance_m(bench, target) < 5e-4
    assert (tick["law"], tick["binding_limits"]) == (law, 0)
    # The arm really went there: most of the way, by a model that is not the controller's.
    there = NEAR.position_m[:2] @ (true_tip(tick) - start)[:2] / (NEAR.position_m[:2] ** 2).sum()
    assert 0.5 < there < 1.5


@pytest.mark.parametrize(
    ("preset", "position", "binding"),
    [
        ("paper", (0.0, 0.0, 0.5), LengthLimit.bit),
        ("paper", (0.0, 0.0, 0.02), LengthLimit.bit),
        ("table1", (0.0, 0.0, 0.4), PressureLimit.bit),
        ("table1", (0.0, 0.0, 0.1), PressureLimit.bit),
    ],
)
def test_out_of_reach_is_said_with_the_limit_that_binds(
    preset: str, position: tuple[float, ...], binding: int
) -> None:
    bench = Bench(preset).activate()
    bench.run(3.0, PositionTarget(np.array(position)))
    assert bench.mode == Mode.ACTIVE
    assert bench.newest["reach"] == Reach.OUT_OF_REACH
    assert int(bench.newest["binding_limits"]) & binding
    assert bench.newest["target_error_m"] > 5e-4


@pytest.mark.parametrize(
    ("target", "kind"),
    [
        (NEAR, PositionTarget.kind),
        (LengthsTarget(np.array([[0.21, 0.2, 0.19]])), LengthsTarget.kind),
        (PressuresTarget(np.array([[1e4, 0.0, -1e4]])), PressuresTarget.kind),
        (TwistTarget(np.array([0.01, 0, 0]), None, False, False), TwistTarget.kind),
    ],
)
def test_the_record_tells_the_target_it_follows(target: Target, kind: int) -> None:
    bench = Bench().activate()
    command = bench.target(target, age_s=0.05)
    tick = bench.tick(command)
    assert (tick["target_kind"], tick["target_sequence"]) == (kind, command.sequence)
    assert tick["target_age_s"] == pytest.approx(0.05)
    known = isinstance(target, PositionTarget)
    assert np.isfinite(tick["target_position_m"]).all() == known
    assert bench.tick()["target_age_s"] == pytest.approx(0.052)
    bench.ask(ModeEvent.HOLD)
    assert bench.newest["target_kind"] == pb.NO_TARGET
    assert np.isnan(bench.newest["target_position_m"]).all()


@pytest.mark.parametrize("order", ["before", "with"])
def test_targets_that_come_before_active_are_dropped(order: str) -> None:
    bench = Bench().get_ready()
    if order == "before":
        bench.run(0.1, NEAR)
        bench.ask(ModeEvent.ENABLE)
    else:  # in the same tick, ahead of the request
        bench.tick(bench.target(NEAR), RequestMode(ModeEvent.ENABLE, 2, "me"))
    assert bench.mode == Mode.ACTIVE
    assert bench.run(0.5)["target_kind"] == pb.NO_TARGET
    assert not bench.newest["pressure_sent_pa"].any() or (
        np.abs(bench.newest["pressure_sent_pa"]).max() < 2000.0
    )


def test_a_target_does_not_survive_holding() -> None:
    bench = Bench().activate()
    bench.run(0.2, NEAR)
    bench.tick(RequestMode(ModeEvent.HOLD, 2, "a"), RequestMode(ModeEvent.ENABLE, 4, "a"))
    assert [reply.accepted for reply in bench.replies[-2:]] == [True, True]
    kept, start = bench.newest["pressure_commanded_pa"].copy(), len(bench.records)
    bench.run(0.3)
    assert bench.mode == Mode.ACTIVE
    sent = bench.ticks()[start:]["pressure_sent_pa"]
    # What went ahead for the valves' lag comes back first, and then nothing moves any more.
    assert sent[10:] == pytest.approx(np.broadcast_to(kept, sent[10:].shape), abs=1.0)


def test_holding_before_the_first_step_holds_nothing_of_the_time_before() -> None:
    bench = Bench().activate()
    bench.run(0.5, NEAR)
    assert np.abs(bench.newest["pressure_sent_pa"]).max() > 1e4
    bench.ask(ModeEvent.VENT)
    bench.get_ready()
    bench.tick(RequestMode(ModeEvent.ENABLE, 2, "a"), RequestMode(ModeEvent.HOLD, 4, "a"))
    assert bench.mode == Mode.HOLD
    bench.run(0.3)
    assert np.abs(bench.newest["pressure_sent_pa"]).max() < 2000.0


@pytest.mark.parametrize("rubbish", [np.nan, np.inf, 1e9])
def test_one_tick_of_rubbish_leaves_nothing_behind(
    rubbish: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench().activate()
    bench.run(1.5, NEAR)
    before = bench.newest["pressure_sent_pa"].copy()
    with monkeypatch.context() as patch:
        patch.setattr(
            bench.loop._steering._controller, "pressures_pa", lambda: np.full((1, 3), rubbish)
        )
        bench.tick()
    assert bench.newest["guard_intervention"]
    bench.ask(ModeEvent.HOLD)
    assert bench.run(0.3)["pressure_sent_pa"] == pytest.approx(before, abs=200.0)
    bench.ask(ModeEvent.ENABLE)
    bench.run(1.0, NEAR)
    assert bench.newest["pressure_sent_pa"] == pytest.approx(before, abs=200.0)


def test_armed_without_a_target_it_waits_for_the_arming_timeout() -> None:
    bench = Bench().activate()
    bench.run(2.9)
    assert bench.mode == Mode.ACTIVE
    bench.run(0.2)
    assert bench.mode == Mode.HOLD


def test_a_lease_given_back_holds_only_where_a_target_was_followed() -> None:
    bench = Bench().activate()
    assert bench.ask(ModeEvent.LEASE_RELEASED).accepted
    assert bench.mode == Mode.ACTIVE
    bench.run(0.1, NEAR)
    assert bench.ask(ModeEvent.LEASE_RELEASED).accepted
    assert bench.mode == Mode.HOLD


def test_without_an_operator_it_vents_after_the_hold_timeout() -> None:
    bench = Bench().activate()
    bench.run(0.5, NEAR)
    bench.ask(ModeEvent.HOLD)
    bench.run(3.0)
    assert bench.mode == Mode.HOLD  # longer than the timeout, but somebody is there
    bench.operator = False
    bench.run(1.9)
    assert bench.mode == Mode.HOLD
    bench.run(0.2)
    assert bench.mode in (Mode.IDLE, Mode.READY)
    assert "hold_timeout" in bench.codes()


def test_a_full_disk_holds_then_vents_and_a_low_one_refuses_to_enable() -> None:
    bench = Bench().activate()
    bench.run(0.5, NEAR)
    bench.disk = Disk.FULL
    bench.run(0.4, NEAR)
    assert (bench.mode, bench.codes()[-1]) == (Mode.HOLD, "disk_full")
    bench.run_until(lambda: bench.mode == Mode.IDLE, 0.2)
    assert bench.codes()[-1] == "disk_still_full"
    bench.disk = Disk.LOW
    bench.get_ready()
    reply = bench.ask(ModeEvent.ENABLE)
    assert not reply.accepted
    assert "log.min_free_mib" in reply.reason
    bench.disk = Disk.OK
    bench.tick()
    assert bench.ask(ModeEvent.ENABLE).accepted


def test_nothing_is_written_before_the_arm_is_active() -> None:
    bench = Bench()
    bench.run(1.0, NEAR)
    assert (bench.mode, bench.hardware.writes) == (Mode.READY, [])
    assert len(bench.hardware.vents) == len(bench.records)


def test_the_arm_does_not_get_ready_before_it_is_recorded() -> None:
    bench = Bench()
    bench.disk = Disk.STARTING
    bench.run(1.0)
    assert bench.mode == Mode.IDLE
    bench.disk = Disk.OK
    bench.tick()
    assert bench.mode == Mode.READY


@pytest.mark.parametrize("failing", ["fail_read", "fail_write", "fail_vent"])
def test_any_exception_of_the_device_is_a_fault_with_its_cause(failing: str) -> None:
    bench = Bench().activate()
    bench.run(0.2, NEAR)
    if failing == "fail_vent":
        bench.hardware.fail_read = OSError("first")
    setattr(bench.hardware, failing, RuntimeError("the cable is out"))
    bench.tick()
    assert (bench.mode, bench.newest["mode"]) == (Mode.FAULT, Mode.FAULT)
    assert "the cable is out" in bench.events[-1].cause
    events = len(bench.events)
    bench.run(0.2)
    assert len(bench.events) == events  # said once, not in every tick
    bench.hardware.fail_read = bench.hardware.fail_write = bench.hardware.fail_vent = None
    vents = len(bench.hardware.vents)
    bench.run(0.1)
    assert len(bench.hardware.vents) == vents + 50  # tried again all the time


def test_a_failed_tick_writes_down_what_was_sent() -> None:
    bench = Bench().activate()
    bench.run(0.3, NEAR)
    assert np.abs(bench.newest["pressure_sent_pa"]).max() > 1e3
    bench.hardware.fail_read = OSError("cable")
    bench.run(0.1)
    assert bench.mode == Mode.FAULT
    assert not bench.newest["pressure_sent_pa"].any()
    assert np.isnan(bench.newest["pressure_measured_pa"]).all()
    assert not bench.loop.pressure_near_zero  # not known


def test_events_and_ticks_have_the_time_of_the_session() -> None:
    bench = Bench().activate()
    bench.run(0.1)
    bench.ask(ModeEvent.HOLD)
    expected = START_UNIX_NS + bench.now_ns - START_NS
    assert bench.newest["time_unix_ns"] == expected
    assert bench.events[-1].time_unix_ns == expected


def test_the_clocks_figures_are_written_down() -> None:
    bench = Bench()
    bench.now_ns += bench.period_ns
    timing = Timing(1e-5, 2e-4, 7)
    record, _ = bench.loop.tick(bench.now_ns, [Heartbeat(False)], Disk.OK, timing)
    tick = np.frombuffer(record, tick_dtype(1))[0]
    assert (tick["wake_latency_s"], tick["compute_s"], tick["overruns"]) == (1e-5, 2e-4, 7)


def test_a_measured_tip_is_written_down_with_its_age() -> None:
    bench = Bench()
    pose = SetTipPose(np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 0.0, 1.0]), bench.now_ns)
    assert bench.tick(pose)["tip_measured_position_m"].tolist() == [1.0, 2.0, 3.0]
    bench.run(0.1)
    assert bench.newest["tip_measured_age_s"] == pytest.approx(0.102)


def test_the_guards_work_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench().activate()
    monkeypatch.setattr(
        bench.loop._steering._controller, "pressures_pa", lambda: np.full((1, 3), 1e6)
    )
    bench.run(0.01)
    assert Intervention(int(bench.newest["guard_intervention"])) & Intervention.RANGE
    assert bench.newest["guard_interventions"] == 5


def test_the_end_of_the_daemon_vents() -> None:
    bench = Bench().activate()
    bench.run(0.5, NEAR)
    bench.loop.vent("the daemon ends")
    assert (bench.mode, bench.events[-1].cause) == (Mode.IDLE, "the daemon ends")
    bench.run_until(lambda: bench.loop.pressure_near_zero, 2.0)
    assert not bench.newest["pressure_sent_pa"].any()

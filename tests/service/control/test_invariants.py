"""The invariants of the design that can be seen in one process, each by its name.

The whole tick runs: controller, guard, simulated arm. Only the clock is missing.
"""

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.targets.targets import PositionTarget
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.processes.pipe import Heartbeat
from tests.service.control.wild import assert_writes_within_limits_and_slew, wild_run
from tools.rig.simulated import Bench, true_tip

PRESETS = ("paper", "table1", "trunk")
FAR = PositionTarget(np.array([0.06, 0.03, 0.2]))


@pytest.mark.parametrize("preset", PRESETS)
def test_1_no_pressure_outside_limits_or_slew_reaches_the_device(preset: str) -> None:
    bench = Bench(preset)
    wild_run(bench, 4.0, seed=1)
    assert_writes_within_limits_and_slew(bench)


@pytest.mark.parametrize(
    "rubbish",
    [np.full((1, 3), 1e9), np.full((1, 3), -np.inf), np.array([[np.nan, 9e4, -9e4]])],
    ids=["huge", "infinite", "not a number"],
)
def test_1_whatever_happens_upstream(rubbish: Array, monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench().activate()
    monkeypatch.setattr(bench.loop._steering._controller, "pressures_pa", lambda: rubbish)
    bench.run(0.5, FAR)
    assert bench.newest["guard_interventions"] > 100
    assert_writes_within_limits_and_slew(bench)


@pytest.mark.parametrize("preset", PRESETS)
def test_2_every_commanded_length_lies_strictly_inside_equation_4(preset: str) -> None:
    bench = Bench(preset)
    wild_run(bench, 4.0, seed=2)
    lengths = bench.ticks()["length_commanded_m"]
    assert np.ptp(lengths) > 0.02  # it moved
    assert (lengths > bench.arm.per_chamber("length_min_m")).all()
    assert (lengths < bench.arm.per_chamber("length_max_m")).all()


def test_3_a_target_older_than_its_timeout_makes_the_arm_hold() -> None:
    bench = Bench().activate()
    bench.run(0.5, FAR)
    assert bench.mode == Mode.ACTIVE
    received_s = bench.now_s
    bench.tick(bench.target(FAR))
    bench.run_until(lambda: bench.mode == Mode.HOLD, 1.0)
    assert 0.2 < bench.now_s - received_s - bench.period_ns * 1e-9 <= 0.2 + 2e-3 + 1e-9
    assert bench.codes()[-1] == "target_stale"
    held = bench.newest["pressure_sent_pa"].copy()
    assert np.abs(held).max() > 1e3
    assert (bench.run(0.5)["pressure_sent_pa"] == held).all()


def test_3_the_age_counts_from_the_receipt_not_from_the_tick() -> None:
    bench = Bench().activate()
    bench.tick(bench.target(FAR, age_s=0.19))
    assert bench.mode == Mode.ACTIVE
    bench.tick(bench.target(FAR, age_s=0.21))
    assert bench.mode == Mode.HOLD


def fault(bench: Bench) -> None:
    bench.hardware.fail_read = ValueError("no answer")
    bench.tick()
    bench.hardware.fail_read = None


def test_5_a_fault_latches_and_vents() -> None:
    bench = Bench().activate()
    bench.run(0.5, FAR)
    vents, writes = len(bench.hardware.vents), len(bench.hardware.writes)
    fault(bench)
    assert bench.mode == Mode.FAULT
    assert len(bench.hardware.vents) == vents + 1
    assert bench.events[-1].cause == "ValueError: no answer"
    bench.run(2.0, FAR)
    assert bench.mode == Mode.FAULT
    assert len(bench.hardware.writes) == writes
    assert not bench.ask(ModeEvent.ENABLE).accepted
    assert bench.ask(ModeEvent.RESET).accepted
    assert bench.mode in (Mode.IDLE, Mode.READY)
    assert np.abs(bench.newest["pressure_measured_pa"]).max() < 2000.0


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("seed", [0, 1])
def test_5_arming_from_ready_never_jumps(preset: str, seed: int) -> None:
    bench = Bench(preset, seed=seed).get_ready()
    before = true_tip(bench.newest)
    bench.ask(ModeEvent.ENABLE)
    start = len(bench.records)
    bench.run(1.0)
    assert bench.mode == Mode.ACTIVE
    moved = bench.ticks()[start:]["tip_true_position_m"] - before
    assert np.linalg.norm(moved, axis=1).max() < 1e-3


@pytest.mark.parametrize("preset", PRESETS)
def test_5_arming_from_hold_never_jumps(preset: str) -> None:
    bench = Bench(preset).activate()
    aim = bench.newest["tip_estimated_position_m"] + np.array([0.03, -0.02, 0.01])
    bench.run(1.5, PositionTarget(aim))
    bench.ask(ModeEvent.HOLD)
    bench.run(1.0)
    before, sent = true_tip(bench.newest), bench.newest["pressure_sent_pa"].copy()
    assert np.abs(sent).max() > 1e3
    bench.ask(ModeEvent.ENABLE)
    start = len(bench.records)
    bench.run(1.0)
    assert bench.mode == Mode.ACTIVE
    moved = bench.ticks()[start:]["tip_true_position_m"] - before
    assert np.linalg.norm(moved, axis=1).max() < 1e-3
    assert bench.newest["pressure_sent_pa"] == pytest.approx(sent, abs=1.0)


def test_5_ready_only_with_the_measured_pressure_near_zero() -> None:
    bench = Bench().activate()
    bench.run(1.0, FAR)
    bench.ask(ModeEvent.VENT)
    while bench.mode == Mode.IDLE:
        assert not (np.abs(bench.newest["pressure_measured_pa"]) < 2000.0).all()
        bench.tick()
    assert bench.mode == Mode.READY
    assert (np.abs(bench.newest["pressure_measured_pa"]) < 2000.0).all()


@pytest.mark.parametrize("others", [[], [ModeEvent.HOLD], [ModeEvent.VENT, ModeEvent.HOLD]])
def test_6_the_stop_acts_in_the_tick_it_arrives_in(others: list[ModeEvent]) -> None:
    bench = Bench().activate()
    bench.run(0.5, FAR)
    vents, writes = len(bench.hardware.vents), len(bench.hardware.writes)
    for event in others:
        bench.ask(event)
    vents, writes = len(bench.hardware.vents), len(bench.hardware.writes)
    reply = bench.ask(ModeEvent.ESTOP, "anybody")
    assert (reply.accepted, reply.mode, reply.sequence) == (
        True,
        Mode.ESTOP,
        bench.newest["sequence"],
    )
    assert (bench.mode, bench.newest["mode"]) == (Mode.ESTOP, Mode.ESTOP)
    assert len(bench.hardware.vents) == vents + 1
    assert len(bench.hardware.writes) == writes
    assert not bench.newest["pressure_sent_pa"].any()


def test_6_the_stop_acts_and_is_answered_while_the_device_fails() -> None:
    bench = Bench().activate()
    bench.run(0.2, FAR)
    bench.hardware.fail_read = OSError("cable")
    reply = bench.ask(ModeEvent.ESTOP)
    assert (reply.accepted, bench.mode) == (True, Mode.ESTOP)
    assert len(bench.hardware.vents) > 0


def test_8_every_tick_has_a_number_also_one_that_failed() -> None:
    bench = Bench().activate()
    bench.run(0.1, FAR)
    for failing in ("fail_read", "fail_write", "fail_vent", "fail_read"):
        setattr(bench.hardware, failing, OSError("cable"))
        bench.run(0.01, FAR)
        setattr(bench.hardware, failing, None)
        bench.ask(ModeEvent.RESET)
        bench.run(0.01)
    ticks = bench.ticks()
    assert ticks["sequence"].tolist() == list(range(1, len(ticks) + 1))
    assert (np.diff(ticks["time_unix_ns"]) == bench.period_ns).all()
    assert (ticks["mode"] == Mode.FAULT).any()


def run_of(seed: int) -> bytes:
    bench = Bench("paper", seed=7)
    wild_run(bench, 2.0, seed)
    return b"".join(bench.records)


def test_11_the_same_inputs_from_the_same_start_give_identical_bits() -> None:
    assert run_of(3) == run_of(3)
    assert run_of(3) != run_of(4)


def test_gateway_silent_means_hold_and_lost_means_vent() -> None:
    bench = Bench().activate()
    bench.run(0.5, FAR)
    bench.heartbeat = False
    heard_s = bench.now_s
    while bench.mode == Mode.ACTIVE:
        bench.tick(bench.target(FAR))
    assert (bench.mode, bench.codes()[-1]) == (Mode.HOLD, "gateway_silent")
    assert 0.2 < bench.now_s - heard_s < 0.21
    bench.run_until(lambda: bench.mode != Mode.HOLD, 3.0)
    assert (bench.mode, bench.codes()[-1]) == (Mode.IDLE, "gateway_lost")
    assert 2.0 < bench.now_s - heard_s < 2.01
    bench.tick(Heartbeat(True))
    assert bench.mode == Mode.IDLE

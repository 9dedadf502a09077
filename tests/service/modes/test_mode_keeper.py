"""What time alone changes: timers at their bounds, and what is told about it."""

from dataclasses import replace

import pytest

from pneuarm.logs.rings.status import Disk
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.modes.mode_keeper import (
    GATEWAY_LOST_S,
    GATEWAY_SILENT_S,
    Conditions,
    ModeKeeper,
    Timeouts,
)

TIMEOUTS = Timeouts(target_s=0.2, arming_s=30.0, hold_s=60.0, full_disk_vent_s=5.0)
WELL = Conditions(
    target_age_s=0.0, gateway_age_s=0.0, operator=True, disk=Disk.OK, pressure_near_zero=True
)


class Kept:
    """A keeper with its events, and the time."""

    def __init__(self, timeouts: Timeouts = TIMEOUTS) -> None:
        self.events: list[pb.Event] = []
        self.keeper = ModeKeeper(timeouts, self.events.append)
        self.now_s = 1000.0

    @property
    def mode(self) -> Mode:
        return self.keeper.mode

    def after(self, seconds: float, watched: Conditions = WELL, step_s: float = 0.01) -> Mode:
        """Let time pass in steps, the last one exactly at the end."""
        end_s = self.now_s + seconds
        while self.now_s < end_s:
            self.now_s = min(self.now_s + step_s, end_s)
            self.keeper.watch(self.now_s, watched)
        return self.mode

    def ask(self, event: ModeEvent) -> str:
        return self.keeper.request(event, self.now_s, "me")

    def active(self) -> "Kept":
        self.after(0.01)
        assert self.ask(ModeEvent.ENABLE) == ""
        return self

    def holding(self) -> "Kept":
        self.active()
        assert self.ask(ModeEvent.HOLD) == ""
        return self


def test_it_begins_idle_and_gets_ready_with_the_pressure_near_zero_and_a_recorder() -> None:
    kept = Kept()
    assert kept.after(1.0, replace(WELL, pressure_near_zero=False)) == Mode.IDLE
    assert kept.after(1.0, replace(WELL, disk=Disk.STARTING)) == Mode.IDLE
    assert kept.after(0.01) == Mode.READY


@pytest.mark.parametrize(("age_s", "mode"), [(0.2, Mode.ACTIVE), (0.2001, Mode.HOLD)])
def test_a_stale_target_holds(age_s: float, mode: Mode) -> None:
    kept = Kept().active()
    assert kept.after(0.01, replace(WELL, target_age_s=age_s)) == mode


def test_armed_without_a_target_it_holds_after_the_arming_timeout() -> None:
    kept, waiting = Kept().active(), replace(WELL, target_age_s=None)
    assert kept.after(29.99, waiting) == Mode.ACTIVE
    assert kept.after(0.02, waiting) == Mode.HOLD


def test_with_targets_it_stays_active() -> None:
    assert Kept().active().after(1000.0, step_s=1.0) == Mode.ACTIVE


def test_hold_without_operator_vents_after_the_timeout() -> None:
    kept, alone = Kept().holding(), replace(WELL, operator=False, pressure_near_zero=False)
    assert kept.after(59.9, alone, 0.1) == Mode.HOLD
    assert kept.after(0.2, alone, 0.1) == Mode.IDLE


def test_hold_with_an_operator_lasts_and_the_timeout_counts_from_when_it_went() -> None:
    kept, alone = Kept().holding(), replace(WELL, operator=False, pressure_near_zero=False)
    assert kept.after(1000.0, step_s=1.0) == Mode.HOLD
    assert kept.after(59.9, alone, 0.1) == Mode.HOLD
    assert kept.after(1.0) == Mode.HOLD
    assert kept.after(59.9, alone, 0.1) == Mode.HOLD
    assert kept.after(0.2, alone, 0.1) == Mode.IDLE


def test_a_hold_that_begins_without_operator_has_its_whole_time() -> None:
    kept, alone = Kept().active(), replace(WELL, operator=False)
    kept.after(100.0, alone, 1.0)
    kept.ask(ModeEvent.HOLD)
    assert kept.after(59.9, alone, 0.1) == Mode.HOLD


@pytest.mark.parametrize(
    ("age_s", "mode"),
    [
        (GATEWAY_SILENT_S, Mode.ACTIVE),
        (GATEWAY_SILENT_S + 1e-3, Mode.HOLD),
        (GATEWAY_LOST_S, Mode.HOLD),
        (GATEWAY_LOST_S + 1e-3, Mode.IDLE),
    ],
)
def test_a_silent_gateway_holds_and_a_lost_one_vents(age_s: float, mode: Mode) -> None:
    assert (GATEWAY_SILENT_S, GATEWAY_LOST_S) == (0.2, 2.0)
    kept = Kept().active()
    lost = replace(WELL, gateway_age_s=age_s, pressure_near_zero=False)
    kept.keeper.watch(kept.now_s, lost)
    assert kept.mode == mode


def test_a_lost_gateway_vents_from_hold_too() -> None:
    kept = Kept().holding()
    lost = replace(WELL, gateway_age_s=2.1, pressure_near_zero=False)
    assert kept.after(0.01, lost) == Mode.IDLE


def test_a_full_disk_holds_then_vents() -> None:
    kept = Kept().active()
    full = replace(WELL, disk=Disk.FULL, pressure_near_zero=False)
    assert kept.after(0.01, full) == Mode.HOLD
    assert kept.after(4.9, full) == Mode.HOLD
    assert kept.after(0.2, full) == Mode.IDLE
    assert [event.code for event in kept.events[-2:]] == ["disk_full", "disk_still_full"]


def test_a_disk_that_fills_during_a_hold_leaves_its_time_too() -> None:
    kept = Kept().holding()
    kept.after(100.0, step_s=1.0)
    full = replace(WELL, disk=Disk.FULL, pressure_near_zero=False)
    assert kept.after(4.9, full) == Mode.HOLD
    kept.after(0.01)  # there is room again
    assert kept.after(4.9, full) == Mode.HOLD
    assert kept.after(0.2, full) == Mode.IDLE


@pytest.mark.parametrize("disk", [Disk.LOW, Disk.FULL])
def test_enabling_is_refused_where_the_session_could_not_be_recorded(disk: Disk) -> None:
    kept = Kept()
    kept.after(0.02, replace(WELL, disk=disk))
    assert "log.min_free_mib" in kept.ask(ModeEvent.ENABLE)
    assert kept.mode == Mode.READY
    assert (kept.events[-1].code, kept.events[-1].client_id) == ("mode_refused", "me")
    kept.after(0.01)
    assert kept.ask(ModeEvent.ENABLE) == ""


def test_low_space_alone_does_not_stop_an_active_arm() -> None:
    assert Kept().active().after(10.0, replace(WELL, disk=Disk.LOW), 0.1) == Mode.ACTIVE


@pytest.mark.parametrize("event", [ModeEvent.ESTOP, ModeEvent.FAULT])
def test_latched_modes_are_left_by_no_timer(event: ModeEvent) -> None:
    kept = Kept().active()
    kept.keeper.apply(event, kept.now_s)
    latched = kept.mode
    for watched in (
        WELL,
        replace(WELL, operator=False, gateway_age_s=100.0, disk=Disk.FULL, target_age_s=9.0),
    ):
        assert kept.after(100.0, watched, 1.0) == latched
    assert "latched" in kept.ask(ModeEvent.ENABLE)
    assert kept.ask(ModeEvent.RESET) == ""
    assert kept.mode == Mode.IDLE


@pytest.mark.parametrize("event", ModeEvent)
def test_every_change_is_told_once_with_cause_and_mode(event: ModeEvent) -> None:
    for mode in Mode:
        kept = Kept()
        kept.keeper.mode = mode
        applied = kept.keeper.apply(event, kept.now_s, "me")
        changed = kept.mode != mode
        assert applied or not changed
        # Who asks for a hold of an arm that holds already is told too.
        assert len(kept.events) == (changed or (applied and event == ModeEvent.HOLD))
        if changed:
            told = kept.events[0]
            assert (told.code, told.source, told.mode) == (event.name.lower(), "control", kept.mode)
            assert told.text
            assert told.client_id == "me"
            assert told.cause or event == ModeEvent.FAULT


def test_what_is_serious_is_told_so() -> None:
    kept = Kept().active()
    kept.keeper.apply(ModeEvent.FAULT, kept.now_s, cause="a leak")
    assert (kept.events[-1].level, kept.events[-1].cause) == (pb.ERROR, "a leak")
    kept.keeper.apply(ModeEvent.ESTOP, kept.now_s)
    assert (kept.events[-1].level, kept.events[-1].remedy) == (pb.WARNING, "reset, then enable")
    kept.ask(ModeEvent.RESET)
    assert kept.events[-1].level == pb.INFO

"""What somebody asks for, when something forbids it although the mode would allow it."""

import pytest

from pneuarm.logs.rings.status import Disk
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.modes.mode_keeper import Conditions, ModeKeeper, Notice, Timeouts

TIMEOUTS = Timeouts(target_s=0.2, arming_s=3.0, hold_s=2.0, full_disk_vent_s=0.5)
BLOCKED = "the leak is still there"


class Kept:
    """A keeper in a mode, with what it tells."""

    def __init__(self, mode: Mode) -> None:
        self.events: list[pb.Event] = []
        self.keeper = ModeKeeper(TIMEOUTS, self.events.append)
        self.keeper.mode = mode

    def ask(self, event: ModeEvent, blocked: str = "") -> str:
        return self.keeper.request(event, 5.0, "ann", blocked)


def conditions(now_operator: bool = True, **other: object) -> Conditions:
    usual = {"target_age_s": 0.0, "gateway_age_s": 0.0, "disk": Disk.OK}
    return Conditions(operator=now_operator, pressure_near_zero=False, **usual | other)


@pytest.mark.parametrize(
    ("mode", "event"), [(Mode.READY, ModeEvent.ENABLE), (Mode.FAULT, ModeEvent.RESET)]
)
def test_what_is_blocked_is_refused_with_the_reason_and_changes_nothing(
    mode: Mode, event: ModeEvent
) -> None:
    kept = Kept(mode)
    assert kept.ask(event, BLOCKED) == BLOCKED
    assert kept.keeper.mode == mode
    (told,) = kept.events
    assert (told.code, told.level, told.text) == ("mode_refused", pb.WARNING, BLOCKED)
    assert (told.client_id, told.mode) == ("ann", mode)
    assert kept.ask(event) == ""
    assert kept.keeper.mode != mode


def test_where_the_mode_forbids_enabling_what_blocks_it_is_told_too() -> None:
    reason = Kept(Mode.IDLE).ask(ModeEvent.ENABLE, BLOCKED)
    assert "idle" in reason
    assert BLOCKED in reason
    assert BLOCKED not in Kept(Mode.IDLE).ask(ModeEvent.HOLD, BLOCKED)
    assert not Kept(Mode.IDLE).ask(ModeEvent.ENABLE).endswith("; ")


@pytest.mark.parametrize("disk", [Disk.LOW, Disk.FULL])
def test_too_little_space_forbids_nothing_but_enabling(disk: Disk) -> None:
    for event in (ModeEvent.HOLD, ModeEvent.VENT, ModeEvent.ESTOP):
        kept = Kept(Mode.ACTIVE)
        kept.keeper.watch(4.9, conditions(disk=Disk.LOW))
        kept.keeper.watch(4.9, conditions(disk=disk))
        kept.keeper.mode = Mode.ACTIVE
        assert kept.ask(event) == ""


def test_a_change_is_told_in_the_words_that_come_with_it_and_what_means_nothing_is_not() -> None:
    kept = Kept(Mode.ACTIVE)
    notice = Notice(pb.ERROR, "leak", "the arm holds", "a tube is off", "put it on")
    assert kept.keeper.apply(ModeEvent.FAULT_HOLD, 1.0, "", "", notice)
    (told,) = kept.events
    assert (told.level, told.code, told.text) == (pb.ERROR, "leak", "the arm holds")
    assert (told.cause, told.remedy) == ("a tube is off", "put it on")
    assert not kept.keeper.apply(ModeEvent.FAULT_HOLD, 2.0, "", "", notice)
    assert len(kept.events) == 1


def test_what_is_asked_again_means_something_and_begins_no_new_time() -> None:
    kept = Kept(Mode.ACTIVE)
    kept.ask(ModeEvent.HOLD)
    assert kept.keeper.apply(ModeEvent.HOLD, 6.5)  # the hold goes on, and its time too
    kept.keeper.watch(7.1, conditions(now_operator=False))
    assert kept.keeper.mode == Mode.IDLE


def test_nothing_is_watched_in_a_mode_that_it_does_not_concern() -> None:
    for mode in (Mode.IDLE, Mode.READY, Mode.FAULT, Mode.ESTOP):
        kept = Kept(mode)
        worst = conditions(False, target_age_s=9.0, gateway_age_s=9.0, disk=Disk.FULL)
        kept.keeper.watch(100.0, worst)
        assert (kept.keeper.mode, kept.events) == (mode, [])


def test_the_texts_of_every_event_name_its_level() -> None:
    serious = {
        "TARGET_STALE", "LEASE_LOST", "GATEWAY_SILENT", "GATEWAY_LOST",
        "DISK_FULL", "DISK_STILL_FULL", "FAULT_HOLD", "ESTOP",
    }  # fmt: skip
    for event in ModeEvent:
        for mode in Mode:
            kept = Kept(mode)
            kept.keeper.apply(event, 1.0)
            for told in kept.events:
                usual = pb.WARNING if event.name in serious else pb.INFO
                assert told.level == (pb.ERROR if event == ModeEvent.FAULT else usual)

"""What a client that comes late is told."""

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.wire.event_history import EventHistory


def event(code: str, mode: int, level: int = pb.INFO, source: str = "control") -> pb.Event:
    return pb.Event(code=code, mode=mode, level=level, source=source)


def codes(events: object) -> list[str]:
    return [each.code for each in events]  # type: ignore[attr-defined]


def history(*events: pb.Event) -> pb.Events:
    kept = EventHistory()
    for each in events:
        kept.add(each)
    return kept.message()


def test_the_newest_are_kept_oldest_first() -> None:
    found = history(*(event(str(n), pb.IDLE) for n in range(1000)))
    assert codes(found.recent) == [str(n) for n in range(900, 1000)]


def test_a_fault_stays_with_its_cause_first_until_reset() -> None:
    before = event("enable", pb.ACTIVE)
    fault = event("overpressure", pb.FAULT, pb.ERROR)
    more = event("leak", pb.FAULT, pb.ERROR)
    chatter = [event("rejected", pb.FAULT, pb.WARNING, "gateway") for _ in range(500)]
    refused = [event("mode_refused", pb.FAULT, pb.WARNING) for _ in range(500)]
    found = history(before, fault, more, *chatter, *refused)
    assert codes(found.latched) == ["overpressure", "leak"]
    assert codes(history(before, fault, more, event("reset", pb.IDLE)).latched) == []


def test_a_stop_in_a_fault_is_told_behind_it() -> None:
    found = history(event("device_lost", pb.FAULT, pb.ERROR), event("estop", pb.ESTOP, pb.WARNING))
    assert codes(found.latched) == ["device_lost", "estop"]


def test_what_other_processes_believe_of_the_mode_clears_nothing() -> None:
    late = event("rejected", pb.ACTIVE, pb.WARNING, "gateway")
    assert codes(history(event("estop", pb.ESTOP), late).latched) == ["estop"]


def test_a_fault_without_end_keeps_its_first_events() -> None:
    errors = [event(str(n), pb.FAULT, pb.ERROR) for n in range(100)]
    assert codes(history(*errors).latched) == [str(n) for n in range(16)]

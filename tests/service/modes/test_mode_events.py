"""Every event of a mode is one of its own, with a cause for the pages."""

from pneuarm.service.modes.mode import Mode, ModeEvent


def test_events_are_numbered_in_a_row_and_none_stands_for_another() -> None:
    assert [event.value for event in ModeEvent] == list(range(1, len(ModeEvent.__members__) + 1))
    assert [event.name for event in ModeEvent] == list(ModeEvent.__members__)
    assert len(Mode) == len(Mode.__members__)


def test_every_event_says_what_brings_it_about() -> None:
    assert all(event.cause for event in ModeEvent)

"""Text of strangers on a terminal."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.event_line import event_line
from pneuarm.logs.schema.printable import name_of, printable

WILD = ["\x1b[2J\x1b[31mred", "a\nb\rc", "\x00\x07", "\x9b31m", "\u202eabc", "\u2028", "\ud800x"]


@pytest.mark.parametrize("text", WILD)
def test_what_no_font_shows_is_escaped(text: str) -> None:
    assert printable(text).isprintable()
    assert "\\" in printable(text)


def test_what_people_write_stays_as_it_is() -> None:
    for text in ("frame_id = 'Welt': größer als 5 µm", "日本", "C:\\arm", ""):
        assert printable(text) == text


@given(st.text(st.characters(), max_size=500), st.integers(0, 500))
def test_any_text_becomes_one_line_that_can_be_written(text: str, at_most: int) -> None:
    shown = printable(text, at_most)
    assert shown.isprintable()
    assert len(shown) <= at_most
    assert shown.encode("utf-8").decode() == shown


@given(st.builds(lambda *t: t, *[st.text(max_size=80)] * 5))
def test_any_event_is_one_line(texts: tuple[str, ...]) -> None:
    text, cause, remedy, client, source = texts
    event = pb.Event(
        text=text, cause=cause, remedy=remedy, client_id=client, source=source, level=77, repeats=3
    )
    line = event_line(event)
    assert line.isprintable()
    assert "3 times" in line


def test_a_value_of_a_newer_daemon_is_told_by_its_number() -> None:
    assert name_of(pb.Mode, pb.HOLD) == "hold"
    assert "77" in name_of(pb.Mode, 77)

"""Replay at the pace of the recording, on a clock that only moves when somebody sleeps."""

from itertools import islice
from pathlib import Path

import pytest

from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.reading.replay import paced
from pneuarm.logs.recording.part import Part
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import EVENT, INFO
from tools.rig.recording import INFO as FACTS
from tools.rig.recording import START_NS, make_session

#: When the events of the log happened, s.
TIMES_S = [0.0, 0.5, 0.25, 1.0, 1.0, 3.5]


class SleepClock:
    """Time passes by sleeping, and by what the listener does meanwhile."""

    def __init__(self) -> None:
        self.now_s = 50.0
        self.slept: list[float] = []

    def read(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        assert seconds > 0
        self.slept.append(seconds)
        self.now_s += seconds


@pytest.fixture
def reader(tmp_path: Path) -> LogReader:
    part = Part(tmp_path / "log.mcap", "paper")
    part.write(INFO, FACTS.SerializeToString(), START_NS)
    for time_s in TIMES_S:
        event = pb.Event(text=f"{time_s:g}")
        part.write(EVENT, event.SerializeToString(), START_NS + int(time_s * 1e9))
    part.finish()
    return LogReader(tmp_path / "log.mcap")


def played(reader: LogReader, speed: float, busy_s: float = 0.0) -> list[tuple[str, float]]:
    """Each event and when it was shown, from the beginning."""
    clock = SleepClock()
    shown = []
    for entry in paced(reader, speed, False, clock.read, clock.sleep):
        if isinstance(entry.message, pb.Event):
            shown.append((entry.message.text, clock.now_s - 50.0))
        clock.now_s += busy_s
    return shown


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_every_entry_comes_in_its_time(reader: LogReader, speed: float) -> None:
    shown = played(reader, speed)
    due = sorted(TIMES_S)  # one was written down after a later one
    assert [text for text, _ in shown] == [f"{time_s:g}" for time_s in due]
    assert [time_s for _, time_s in shown] == pytest.approx([time_s / speed for time_s in due])


def test_a_slow_listener_does_not_make_the_replay_drift(reader: LogReader) -> None:
    shown = dict(played(reader, 1.0, busy_s=0.1))
    assert shown["3.5"] == pytest.approx(3.5)


def test_without_loop_it_ends_and_with_loop_it_begins_again(reader: LogReader) -> None:
    clock = SleepClock()
    entries = list(paced(reader, 1.0, False, clock.read, clock.sleep))
    assert len(entries) == 1 + len(TIMES_S)
    clock = SleepClock()
    twice = list(islice(paced(reader, 1.0, True, clock.read, clock.sleep), 2 * len(entries)))
    assert [e.message for e in twice] == [e.message for e in (*entries, *entries)]
    assert clock.now_s - 50.0 == pytest.approx(7.0)
    assert clock.slept == pytest.approx([0.25, 0.25, 0.5, 2.5] * 2)


@pytest.mark.parametrize("hole_s", [86_400.0, 3e8])
@pytest.mark.parametrize("speed", [0.5, 20.0])
def test_a_hole_is_told_and_not_waited_for(tmp_path: Path, hole_s: float, speed: float) -> None:
    part = Part(tmp_path / "log.mcap", "paper")
    part.write(INFO, FACTS.SerializeToString(), START_NS)
    for time_s in (0.0, 1.0, hole_s + 1.0, hole_s + 2.0, 2 * hole_s + 2.0):
        part.write(EVENT, pb.Event().SerializeToString(), START_NS + int(time_s * 1e9))
    part.finish()
    clock, told = SleepClock(), []
    reader = LogReader(tmp_path / "log.mcap")
    assert len(list(paced(reader, speed, False, clock.read, clock.sleep, told.append))) == 6
    assert clock.now_s - 50.0 == pytest.approx(2.0 / speed)
    assert [f"{hole_s:.1f} s" in text for text in told] == [True, True]


def test_a_recorded_session_is_replayed_from_its_first_tick_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = make_session(tmp_path, monkeypatch)
    session.write_ticks(101)  # before its recorder was there
    session.recorder().finish()
    clock = SleepClock()
    for entry in paced(LogReader(session.path), 1.0, False, clock.read, clock.sleep):
        if isinstance(entry.message, pb.ArmState):
            due_s = (entry.message.sequence - 1) * 0.002
            assert clock.now_s - 50.0 == pytest.approx(due_s, abs=1e-6)
    assert clock.now_s - 50.0 == pytest.approx(0.2)

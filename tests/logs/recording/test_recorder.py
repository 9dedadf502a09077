"""The recorder: everything that is written into the rings is in the files, whatever happens."""

import os
from pathlib import Path

import pytest

from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.reading.summary import summarise
from pneuarm.logs.recording.session import is_finished
from pneuarm.logs.rings.status import Disk
from pneuarm.logs.schema.topics import INFO, STATE, TF, TIP
from tools.rig.recording import PERIOD_NS, START_NS, Session, make_session, recorded


@pytest.fixture
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Session:
    return make_session(tmp_path / "sessions", monkeypatch)


def events(count: int) -> set[str]:
    return {f"event {number}" for number in range(1, count + 1)}


def test_every_tick_and_every_message_of_the_rings_is_in_the_file(session: Session) -> None:
    session.write_ticks(1300)
    session.write_events(40)
    recorder = session.recorder()
    session.flush(recorder)
    session.write_ticks(700)
    session.write_events(20)
    recorder.finish()
    ticks, texts = recorded(session.path)
    assert ticks == list(range(1, 2001))
    assert len(texts) == 60
    assert set(texts) == events(60)
    summary = summarise(LogReader(session.path))
    assert (summary.ticks, summary.missing_ticks, summary.finished) == (2000, 0, True)
    assert session.status.missed == 0


def test_the_file_holds_the_ticks_as_they_were_written(session: Session) -> None:
    session.write_ticks(20)
    recorder = session.recorder()
    written = [record for _, record in _ticks_of(session)]
    recorder.finish()
    ticks = LogReader(session.path).ticks()
    assert [tick.tobytes() for tick in ticks] == written


def _ticks_of(session: Session) -> list[tuple[int, bytes]]:
    from pneuarm.logs.rings.ring import RingReader

    return RingReader(session.rings.ticks).read(1000)


def test_frames_are_logged_at_100_hz(session: Session) -> None:
    session.write_ticks(100)  # at 500 Hz: one in five
    session.recorder().finish()
    messages = summarise(LogReader(session.path)).messages
    assert (messages[TIP.key], messages[TF.key], messages[STATE.key]) == (20, 20, 100)


def test_the_time_of_a_log_never_runs_backwards(session: Session) -> None:
    session.write_ticks(300)
    session.configure(roll_bytes=1)
    recorder = session.recorder()
    for _ in range(3):
        session.flush(recorder)
        session.write_ticks(300)
    recorder.finish()
    times = [entry.time_unix_ns for entry in LogReader(session.path)]
    assert times == sorted(times)
    assert times[0] == START_NS
    assert times[-1] == START_NS + 1199 * PERIOD_NS


def test_rolling_by_size_leaves_no_gap_and_the_reader_joins_the_parts(session: Session) -> None:
    session.configure(roll_bytes=20_000)
    recorder = session.recorder()
    for _ in range(12):
        session.write_ticks(200)
        session.write_events(2)
        session.flush(recorder)
    recorder.finish()
    reader = LogReader(session.path)
    assert len(reader.parts) > 3
    assert reader.finished
    ticks, texts = recorded(session.path)
    assert ticks == list(range(1, 2401))
    assert len(texts) == 24
    assert set(texts) == events(24)
    # Each part can be read alone: it begins with the facts.
    assert all(LogReader(part).info.arm == "paper" for part in reader.parts)
    assert summarise(reader).messages[INFO.key] == len(reader.parts)


def test_rolling_by_time(session: Session) -> None:
    session.configure(roll_s=60.0)
    recorder = session.recorder()
    for _ in range(170):
        session.write_ticks(1)
        session.flush(recorder)
    recorder.finish()
    parts = LogReader(session.path).parts
    assert len(parts) == 3
    assert recorded(session.path)[0] == list(range(1, 171))


def test_a_part_that_cannot_be_opened_leaves_the_one_before_going_on(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    session.configure(roll_bytes=1)
    recorder = session.recorder()
    refusing = True

    def no_inode(*arguments: object) -> None:
        if refusing:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr("pneuarm.logs.recording.recorder.delete_oldest", no_inode)
    session.write_ticks(100)
    session.flush(recorder)
    session.flush(recorder)
    assert len(LogReader(session.path).parts) == 1
    refusing = False
    session.write_ticks(100)
    session.flush(recorder)
    recorder.finish()
    assert len(LogReader(session.path).parts) == 2
    assert recorded(session.path)[0] == list(range(1, 201))


@pytest.mark.parametrize("flushes", [0, 1, 3])
@pytest.mark.parametrize("roll_bytes", [1, 1 << 30])
def test_a_successor_goes_on_where_a_recorder_died(
    session: Session, flushes: int, roll_bytes: int
) -> None:
    session.configure(roll_bytes=roll_bytes)
    dead = session.recorder()
    for _ in range(flushes):
        session.write_ticks(100)
        session.write_events(3)
        session.flush(dead)
    session.write_ticks(50)
    session.write_events(3)
    dead.step()  # taken from the rings, and not yet on the disk
    del dead
    session.write_ticks(50)
    session.recorder().finish()
    # Without a single flush the first part is empty, and only the successor's can be read.
    parts = sorted(session.settings.directory.glob("*.mcap"))
    ticks, texts = recorded(session.path if flushes else parts[0])
    assert ticks == list(range(1, 100 * flushes + 101))  # each of them once
    assert len(texts) == 3 * flushes + 3
    assert set(texts) == events(3 * flushes + 3)


def test_a_second_successor_too(session: Session) -> None:
    for _ in range(3):  # dies each time before it was able to tell anything
        session.write_ticks(10)
        session.recorder().step()
    session.recorder().finish()
    parts = sorted(session.settings.directory.glob("*.mcap"))
    assert [is_finished(part) for part in parts].count(True) == 1
    assert len(parts) == 4


def test_what_was_overwritten_before_it_was_read_is_counted(session: Session) -> None:
    recorder = session.recorder()
    capacity = session.rings.ticks.capacity
    session.write_ticks(capacity + 1000)
    session.flush(recorder)
    recorder.finish()
    summary = summarise(LogReader(session.path))
    assert session.status.missed > 0
    assert summary.missing_ticks == session.status.missed
    assert summary.ticks + summary.missing_ticks == capacity + 1000


@pytest.mark.parametrize(("min_free_bytes", "disk"), [(0, Disk.OK), (1 << 62, Disk.LOW)])
def test_low_free_space_is_said(session: Session, min_free_bytes: int, disk: Disk) -> None:
    session.configure(min_free_bytes=min_free_bytes)
    assert session.status.disk == Disk.STARTING
    recorder = session.recorder()
    session.flush(recorder)
    space = os.statvfs(session.settings.directory)
    assert session.status.disk == disk
    assert 0 < session.status.free_bytes <= space.f_blocks * space.f_frsize


def test_old_sessions_are_deleted_to_keep_what_was_configured(session: Session) -> None:
    session.settings.directory.mkdir()
    session.recorder().finish()
    old = session.path.rename(session.settings.directory / "20260101T000000Z-paper.mcap")
    session.configure(keep_bytes=old.stat().st_size // 2)
    session.recorder().finish()
    assert not old.exists()
    assert len(list(session.settings.directory.glob("*.mcap"))) == 1


def test_finishing_may_be_tried_again(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    session.configure(roll_bytes=1)
    recorder = session.recorder()
    session.write_ticks(100)
    session.flush(recorder)  # rolls: one part is still to be finished, one is open
    session.write_ticks(100)
    real_write, calls = os.write, []

    def full_at_second(descriptor: int, data: bytes) -> int:
        calls.append(len(data))
        if len(calls) == 2:
            raise OSError(28, "No space left on device")
        return real_write(descriptor, data)

    monkeypatch.setattr("pneuarm.logs.recording.part.os.write", full_at_second)
    with pytest.raises(OSError, match="No space"):
        recorder.finish()
    recorder.finish()
    recorder.finish()
    assert LogReader(session.path).finished
    assert recorded(session.path)[0] == list(range(1, 201))


def test_what_is_told_after_the_end_of_a_log_that_waits_for_the_disk_harms_it_not(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pneuarm.logs.recording.recorder._FLUSH_S", 0.0)
    recorder = session.recorder()
    session.write_ticks(100)
    session.flush(recorder)
    session.write_ticks(100)
    real_write = os.write

    def full(descriptor: int, data: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pneuarm.logs.recording.part.os.write", full)
    for _ in range(3):
        with pytest.raises(OSError, match="No space"):
            recorder.finish()
        session.write_events(1)
    monkeypatch.setattr("pneuarm.logs.recording.part.os.write", real_write)
    recorder.finish()
    assert LogReader(session.path).finished
    assert recorded(session.path)[0] == list(range(1, 201))


@pytest.mark.parametrize("start", [2**32 - 150, 2**32, 2**53, 2**62])
def test_no_counter_of_a_tick_ends(session: Session, start: int) -> None:
    """A daemon that has run for 49 days at 1 kHz, and its successor, write on."""
    session.begin_at(start)
    recorder = session.recorder()
    session.write_ticks(300)
    session.write_events(30)
    session.flush(recorder)
    session.write_ticks(100)
    recorder.step()
    del recorder
    session.write_ticks(100)
    session.recorder().finish()
    ticks, texts = recorded(session.path)
    assert ticks == list(range(start + 1, start + 501))
    assert set(texts) == events(30)
    assert session.status.missed == 0
    summary = summarise(LogReader(session.path))
    assert (summary.ticks, summary.missing_ticks) == (500, start)


def test_messages_are_written_before_the_ticks_of_a_backlog(session: Session) -> None:
    """However far behind it is: a recorder that is killed then has lost no event."""
    recorder = session.recorder()
    session.write_ticks(session.rings.ticks.capacity - 1)
    session.write_events(20)
    recorder.step()
    recorder._part.flush()
    assert set(recorded(session.path)[1]) == events(20)
    recorder.finish()
    assert summarise(LogReader(session.path)).missing_ticks == 0


def test_what_was_written_out_of_order_is_read_in_the_order_of_time(session: Session) -> None:
    """Events stand before the ticks of a backlog in the file, and are read where they happened."""
    recorder = session.recorder()
    session.write_ticks(session.rings.ticks.capacity // 2)
    at_ns = START_NS + session.rings.ticks.capacity // 4 * PERIOD_NS
    session.write_events(3, at_ns)
    recorder.finish()
    times = [entry.time_unix_ns for entry in LogReader(session.path)]
    assert times == sorted(times)
    assert times.count(at_ns) >= 4  # the events, and the tick of that moment


def test_a_recorder_that_lags_gives_up_compression_before_ticks(session: Session) -> None:
    recorder = session.recorder()
    session.write_ticks(session.rings.ticks.capacity - 1)
    recorder.step()
    session.clock.now_s += 1.0
    recorder.step()
    assert session.status.behind > 0
    assert not recorder._part.compress
    session.flush(recorder)
    assert session.status.behind == 0
    assert recorder._part.compress
    recorder.finish()
    summary = summarise(LogReader(session.path))
    assert summary.missing_ticks == 0
    assert summary.messages[TIP.key] < summary.ticks / 5  # what the ticks tell was left out


def test_what_a_recorder_lost_counts_on_with_its_successor(session: Session) -> None:
    recorder = session.recorder()
    session.write_ticks(session.rings.ticks.capacity + 500)
    session.flush(recorder)
    lost = session.status.missed_ticks
    assert lost > 0
    del recorder
    session.recorder().finish()
    assert (session.status.missed_ticks, session.status.missed_messages) == (lost, 0)


def test_the_facts_are_repeated_so_that_a_damaged_beginning_does_not_take_them(
    session: Session,
) -> None:
    recorder = session.recorder()
    for _ in range(12):
        session.write_ticks(10)
        session.flush(recorder)
    recorder.finish()
    damaged = bytearray(session.path.read_bytes())
    damaged[:2000] = bytes(2000)
    session.path.write_bytes(damaged)
    reader = LogReader(session.path)
    assert reader.info == session.info
    assert reader.damage


def test_an_hour_is_read_in_little_memory(session: Session) -> None:
    """As batches, or as the fields that are wanted: nothing grows with the length of a log."""
    recorder = session.recorder()
    session.write_ticks(3000)
    recorder.finish()
    reader = LogReader(session.path)
    batches = list(reader.tick_batches())
    assert max(map(len, batches)) <= 1000
    assert sum(map(len, batches)) == 3000
    some = reader.ticks(["time_unix_ns", "pressure_measured_pa"])
    assert some.dtype.names == ("sequence", "time_unix_ns", "pressure_measured_pa")
    assert some.itemsize < reader.ticks().itemsize / 10

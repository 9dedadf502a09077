"""Session files: names, parts, what a crash leaves, and mending it."""

import fcntl
import os
import struct
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import MCAP0_MAGIC, Writer

from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.recording.part import Part
from pneuarm.logs.recording.repair import repair
from pneuarm.logs.recording.session import (
    delete_oldest,
    is_finished,
    part_path,
    session_name,
    unfinished,
)
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import EVENT, INFO
from tools.rig.recording import INFO as INFO_OF_ALL
from tools.rig.recording import make_session, recorded

CHUNKS = 8
TICKS = 60  # a chunk
CHUNK = 6  # kind of record


@dataclass(frozen=True, repr=False)
class Whole:
    """A finished session file, and where each of its chunks ends."""

    content: bytes
    ends: list[int]

    def __repr__(self) -> str:
        return "Whole"

    def chunks_within(self, size: int) -> int:
        return sum(end <= size for end in self.ends)


def chunk_ends(content: bytes) -> list[int]:
    """Walk the records of an MCAP file: one byte of kind, eight of length, the rest."""
    ends, position = [], len(MCAP0_MAGIC)
    while position < len(content) - len(MCAP0_MAGIC):
        kind, length = struct.unpack_from("<BQ", content, position)
        position += 9 + length
        if kind == CHUNK:
            ends.append(position)
    return ends


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Whole:
    with pytest.MonkeyPatch.context() as patch:
        session = make_session(tmp_path_factory.mktemp("whole"), patch)
        recorder = session.recorder()
        for _ in range(CHUNKS):
            session.write_ticks(TICKS)
            session.write_events(1)
            session.flush(recorder)
        recorder.finish()
    content = session.path.read_bytes()
    ends = chunk_ends(content)
    assert len(ends) == 1 + CHUNKS  # the first holds the info alone
    return Whole(content, ends)


@given(share=st.floats(0, 1), near=st.integers(-9, 9))
def test_a_file_cut_anywhere_is_readable_up_to_its_last_whole_chunk(
    whole: Whole, tmp_path_factory: pytest.TempPathFactory, share: float, near: int
) -> None:
    # Half of the cuts fall close to the end of a chunk, where the mistakes are.
    size = int(share * len(whole.content))
    if near % 2:
        size = whole.ends[int(share * CHUNKS)] + near
    path = tmp_path_factory.mktemp("cut") / "cut.mcap"
    path.write_bytes(whole.content[:size])
    chunks = whole.chunks_within(size)
    if chunks == 0:
        with pytest.raises(LogError):
            LogReader(path)
    else:
        ticks, texts = recorded(path)
        assert ticks == list(range(1, (chunks - 1) * TICKS + 1))
        assert len(texts) == chunks - 1


@pytest.mark.parametrize("chunks", range(CHUNKS + 2))
def test_a_broken_file_is_mended_with_everything_that_was_whole(
    whole: Whole, tmp_path: Path, chunks: int
) -> None:
    path = tmp_path / "20260102T000000Z-paper.mcap"
    end = whole.ends[chunks] if chunks <= CHUNKS else len(whole.content)
    path.write_bytes(whole.content[: end - 1])
    assert unfinished(tmp_path) == [path]
    mended = repair(path)
    if chunks == 0:
        kept = tmp_path / "20260102T000000Z-paper.mcap.broken"
        assert (mended.path, mended.messages, mended.kept) == (None, 0, kept)
        assert list(tmp_path.iterdir()) == [kept]
        assert kept.read_bytes() == whole.content[: end - 1]
        return
    assert (mended.path, mended.kept) == (path, None)
    assert mended.messages == sum(1 for _ in LogReader(path))
    with path.open("rb") as file:
        metadata = list(make_reader(file).iter_metadata())
    assert [record.metadata for record in metadata] == [{"config_toml": INFO_OF_ALL.config_toml}]
    assert recorded(path)[0] == list(range(1, (chunks - 1) * TICKS + 1))
    assert LogReader(path).finished
    assert unfinished(tmp_path) == []
    assert list(tmp_path.iterdir()) == [path]


def test_mending_a_mended_file_changes_nothing(whole: Whole, tmp_path: Path) -> None:
    path = tmp_path / "20260102T000000Z-paper.mcap"
    path.write_bytes(whole.content[: whole.ends[3]])
    repair(path)
    before = [(entry.topic, entry.message, entry.time_unix_ns) for entry in LogReader(path)]
    repair(path)
    assert [(e.topic, e.message, e.time_unix_ns) for e in LogReader(path)] == before


@pytest.mark.parametrize("content", [b"", b"\x89MC", b"\x89MCAP0\r\n"])
def test_a_file_that_holds_nothing_is_set_aside(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "20260101T000000Z-x.mcap"
    path.write_bytes(content)
    os.utime(path, (0, 0))  # a new one may be a recorder's that has not locked it yet
    assert unfinished(tmp_path) == [path]
    taken = tmp_path / f"{path.name}.broken"
    taken.write_bytes(b"of the time before")
    mended = repair(path)
    assert (mended.path, mended.messages) == (None, 0)
    assert mended.kept is not None
    assert mended.kept.read_bytes() == content
    assert taken.read_bytes() == b"of the time before"
    assert unfinished(tmp_path) == []


def test_what_is_not_ours_is_neither_mended_nor_deleted(tmp_path: Path, whole: Whole) -> None:
    """Rubbish and other people's logs by a name like ours, links, pipes, folders, other names."""
    rubbish = tmp_path / "20260101T000000Z-rubbish.mcap"
    rubbish.write_bytes(b"rubbish" * 100)
    cut = tmp_path / "20260101T000000Z-cut.mcap"
    others = tmp_path / "20260101T000000Z-others.mcap"
    for path, finish in ((cut, False), (others, True)):
        with path.open("wb") as file:
            writer = Writer(file)
            writer.start()
            writer.add_attachment(1, 1, "notes", "text/plain", b"precious")
            channel = writer.register_channel("chatter", "json", 0)
            writer.add_message(channel, 1, b"{}", 1)
            writer.finish() if finish else writer.flush()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    target = elsewhere / "20260101T000000Z-paper.mcap"
    target.write_bytes(whole.content[: whole.ends[3]])
    (tmp_path / "20260101T000000Z-link.mcap").symlink_to(target)
    (tmp_path / "20260101T000000Z-folder.mcap").mkdir()
    os.mkfifo(tmp_path / "20260101T000000Z-pipe.mcap")
    (tmp_path / "run.mcap").write_bytes(whole.content)
    (tmp_path / "20260101T000000Z-young.mcap").touch()
    before = {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    assert unfinished(tmp_path) == []
    assert delete_oldest(tmp_path, 1) == []
    assert {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()} == before
    with pytest.raises(LogError, match="link"):
        repair(tmp_path / "20260101T000000Z-link.mcap")
    assert target.read_bytes() == whole.content[: whole.ends[3]]


def test_mending_writes_through_no_link(tmp_path: Path, whole: Whole) -> None:
    precious = tmp_path / "precious"
    precious.write_bytes(b"of somebody")
    path = tmp_path / "20260102T000000Z-paper.mcap"
    path.write_bytes(whole.content[: whole.ends[3]])
    (tmp_path / f"{path.name}.repairing").symlink_to(precious)
    (tmp_path / "20260102T000000Z-paper.repairing").symlink_to(precious)
    assert repair(path).path == path
    assert precious.read_bytes() == b"of somebody"
    assert is_finished(path)
    assert not path.is_symlink()


@pytest.mark.parametrize("bit", range(8))
@pytest.mark.parametrize("chunk", [0, 1, 3])
def test_mending_loses_one_flipped_chunk_and_keeps_the_original(
    tmp_path: Path, whole: Whole, chunk: int, bit: int
) -> None:
    """A log that broke off, with a bit flipped near its beginning: the rest is still there."""
    path = tmp_path / "20260102T000000Z-paper.mcap"
    broken = bytearray(whole.content[: whole.ends[-1]])
    broken[whole.ends[chunk] - 40] ^= 1 << bit
    path.write_bytes(broken)
    ticks = recorded(path)[0]
    assert len(ticks) >= (CHUNKS - 1) * TICKS
    mended = repair(path)
    assert mended.kept == tmp_path / f"{path.name}.broken"
    assert mended.kept.read_bytes() == bytes(broken)
    assert mended.dropped_bytes > 0
    assert recorded(path)[0] == ticks
    assert LogReader(path).finished


def test_a_file_that_somebody_holds_is_not_mended(tmp_path: Path, whole: Whole) -> None:
    path = tmp_path / "20260102T000000Z-paper.mcap"
    path.write_bytes(whole.content[: whole.ends[3]])
    with path.open("rb") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(LogError, match="in use"):
            repair(path)
    assert path.read_bytes() == whole.content[: whole.ends[3]]


def test_where_there_is_no_room_the_broken_file_stays_as_it_is(
    whole: Whole, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "20260102T000000Z-paper.mcap"
    path.write_bytes(whole.content[: whole.ends[3]])

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pneuarm.logs.recording.repair.os.fsync", full)
    with pytest.raises(
        LogError, match=r"20260102T000000Z-paper\.mcap cannot be repaired: .*free some space"
    ):
        repair(path)
    assert path.read_bytes() == whole.content[: whole.ends[3]]
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_that_a_recorder_holds_is_not_taken_for_broken(tmp_path: Path) -> None:
    part = Part(tmp_path / "20260102T000000Z-paper.mcap", "paper")
    part.write(EVENT, pb.Event(text="one").SerializeToString(), 1)
    part.flush()
    assert unfinished(tmp_path) == []
    os.close(part._file._fd)  # as when its process dies
    assert unfinished(tmp_path) == [tmp_path / "20260102T000000Z-paper.mcap"]


def test_names() -> None:
    assert session_name(1_795_350_943_000_000_000, "paper") == "20261122T123543Z-paper"
    names = [part_path(Path(), "s", part).name for part in (0, 1, 2, 10, 1000)]
    assert names == ["s.mcap", "s.001.mcap", "s.002.mcap", "s.010.mcap", "s.1000.mcap"]


def write_part(path: Path, session: str, number: int) -> Path:
    """A finished part of 100 s in which each event has its number."""
    part = Part(path, "paper", session, number)
    time_ns = (number + 1) * 100_000_000_000 + (10**15 if "0102" in session else 0)
    event = pb.Event(text=f"{session} {number}")
    part.write(INFO, INFO_OF_ALL.SerializeToString(), time_ns)
    part.write(EVENT, event.SerializeToString(), time_ns)
    part.finish()
    return path


@pytest.mark.parametrize("kept", range(6))
def test_the_oldest_parts_go_first(tmp_path: Path, kept: int) -> None:
    old, new = "20260101T000000Z-paper", "20260102T000000Z-paper"
    paths = [
        write_part(part_path(tmp_path, session, number), session, number)
        for session, numbers in ((old, (0, 999, 1000)), (new, (0, 1)))
        for number in numbers
    ]
    sizes = [path.stat().st_size for path in paths]
    deleted = delete_oldest(tmp_path, sum(sizes[5 - kept :]) or 1)
    assert set(deleted) == set(paths[: 5 - kept])
    assert set(tmp_path.iterdir()) == set(paths[5 - kept :])


def test_nothing_is_deleted_that_is_unfinished_or_where_all_is_kept(
    tmp_path: Path, whole: Whole
) -> None:
    (tmp_path / "20260101T000000Z-paper.mcap").write_bytes(whole.content[: whole.ends[2]])
    assert delete_oldest(tmp_path, 1) == []
    (tmp_path / "20260102T000000Z-paper.mcap").write_bytes(whole.content)
    assert delete_oldest(tmp_path, 0) == []
    assert len(list(tmp_path.iterdir())) == 2
    with (tmp_path / "20260102T000000Z-paper.mcap").open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert delete_oldest(tmp_path, 1) == []

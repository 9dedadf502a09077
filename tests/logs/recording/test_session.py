"""Session files: names, parts, what a crash leaves, and mending it."""

import contextlib
import os
import struct
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.records import Metadata
from mcap.writer import MCAP0_MAGIC, Writer

from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.recording.part import Part
from pneuarm.logs.recording.session import (
    delete_oldest,
    is_finished,
    part_path,
    parts_of,
    repair,
    session_name,
    unfinished,
    whole_records,
)
from tests.logs.recording.recording import INFO, make_session, recorded

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


@given(place=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7))
def test_a_damaged_file_is_read_or_refused(
    whole: Whole, tmp_path_factory: pytest.TempPathFactory, place: float, bit: int
) -> None:
    damaged = bytearray(whole.content)
    damaged[int(place * len(damaged))] ^= 1 << bit
    path = tmp_path_factory.mktemp("damaged") / "damaged.mcap"
    path.write_bytes(damaged)
    with contextlib.suppress(LogError):
        for entry in LogReader(path):
            assert entry.topic.message is not None
    with contextlib.suppress(LogError):
        assert is_finished(repair(path)[0]) or path.with_suffix(".mcap.broken").exists()


@pytest.mark.parametrize("chunks", range(CHUNKS + 2))
def test_a_broken_file_is_mended_with_everything_that_was_whole(
    whole: Whole, tmp_path: Path, chunks: int
) -> None:
    path = tmp_path / "20260102T000000Z-paper.mcap"
    end = whole.ends[chunks] if chunks <= CHUNKS else len(whole.content)
    path.write_bytes(whole.content[: end - 1])
    assert unfinished(tmp_path) == [path]
    mended, messages = repair(path)
    if chunks == 0:
        assert (mended.name, messages) == ("20260102T000000Z-paper.mcap.broken", 0)
        assert list(tmp_path.iterdir()) == [mended]
        assert mended.read_bytes() == whole.content[: end - 1]
        return
    assert mended == path
    assert messages == sum(1 for _ in LogReader(path))
    metadata = [record for record in whole_records(path) if isinstance(record, Metadata)]
    assert [record.metadata for record in metadata] == [{"config_toml": INFO.config_toml}]
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


@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r\n", b"rubbish" * 100])
def test_a_file_without_a_whole_record_is_set_aside(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "20260101T000000Z-x.mcap"
    path.write_bytes(content)
    assert unfinished(tmp_path) == [path]
    mended, messages = repair(path)
    assert (mended.name, messages, mended.read_bytes()) == (f"{path.name}.broken", 0, content)
    assert unfinished(tmp_path) == []


def test_mending_keeps_messages_of_others_without_schema_too(tmp_path: Path) -> None:
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("chatter", "json", 0)
        writer.add_message(channel, 1, b"{}", 1)
        writer.flush()
    assert repair(path) == (path, 1)
    assert is_finished(path)


def test_where_there_is_no_room_the_broken_file_stays_as_it_is(
    whole: Whole, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "20260102T000000Z-paper.mcap"
    path.write_bytes(whole.content[: whole.ends[3]])

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pneuarm.logs.recording.session.os.fsync", full)
    with pytest.raises(
        LogError, match=r"20260102T000000Z-paper\.mcap cannot be repaired: .*free some space"
    ):
        repair(path)
    assert path.read_bytes() == whole.content[: whole.ends[3]]
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_that_a_recorder_holds_is_not_taken_for_broken(tmp_path: Path) -> None:
    part = Part(tmp_path / "20260102T000000Z-paper.mcap", "paper")
    part.add_metadata("a", {})
    part.flush()
    assert unfinished(tmp_path) == []
    os.close(part._file._fd)  # as when its process dies
    assert unfinished(tmp_path) == [tmp_path / "20260102T000000Z-paper.mcap"]


def test_names_and_parts(tmp_path: Path) -> None:
    assert session_name(1_795_350_943_000_000_000, "paper") == "20261122T123543Z-paper"
    paths = [part_path(tmp_path, "s", part) for part in (0, 1, 2, 10)]
    assert [path.name for path in paths] == ["s.mcap", "s.001.mcap", "s.002.mcap", "s.010.mcap"]
    for path in (*paths, tmp_path / "s-2.mcap", tmp_path / "s.001.mcap.broken"):
        path.write_bytes(b"")
    assert parts_of(paths[0]) == paths
    assert parts_of(paths[1]) == [paths[1]]


@pytest.mark.parametrize("kept", range(6))
def test_the_oldest_parts_go_first(tmp_path: Path, kept: int) -> None:
    old, new = "20260101T000000Z-paper", "20260102T000000Z-paper"
    parts = (".mcap", ".001.mcap", ".002.mcap")
    names = [*(old + part for part in parts), *(new + part for part in parts[:2])]  # oldest first
    magic = b"\x89MCAP0\r\n"
    for name in names:
        (tmp_path / name).write_bytes(magic + bytes(84) + magic)
    deleted = delete_oldest(tmp_path, kept * 100 + 50 if kept else 1)
    assert {path.name for path in deleted} == set(names[: 5 - kept])
    assert {path.name for path in tmp_path.iterdir()} == set(names[5 - kept :])


def test_nothing_is_deleted_that_is_unfinished_or_where_all_is_kept(tmp_path: Path) -> None:
    (tmp_path / "20260101T000000Z-paper.mcap").write_bytes(bytes(100))
    assert delete_oldest(tmp_path, 1) == []
    (tmp_path / "20260102T000000Z-paper.mcap").write_bytes(b"\x89MCAP0\r\n" * 2)
    assert delete_oldest(tmp_path, 0) == []
    assert len(list(tmp_path.iterdir())) == 2


def test_files_of_other_programs_are_left_alone(tmp_path: Path) -> None:
    magic = b"\x89MCAP0\r\n"
    (tmp_path / "mine.mcap").write_bytes(magic + bytes(84) + magic)
    (tmp_path / "broken.mcap").write_bytes(magic)
    assert delete_oldest(tmp_path, 1) == []
    assert unfinished(tmp_path) == []

"""The parts of a session are found by what is in them, whatever they are called."""

import random
import shutil
from pathlib import Path

import pytest
from mcap.writer import Writer

from pneuarm.logs.reading.parts import parts_of
from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.reading.summary import summarise
from pneuarm.logs.recording.part import Part
from pneuarm.logs.recording.session import part_path
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import INFO, STATE
from tools.rig.recording import INFO as FACTS
from tools.rig.recording import START_NS, make_session

NAMES = ("run [3].mcap", "run*.mcap", "ü?.mcap", "a.b.c.mcap", "999.mcap")


def write_part(path: Path, session: str, number: int, ticks: range) -> Path:
    part = Part(path, "paper", session, number)
    part.write(INFO, FACTS.SerializeToString(), START_NS + ticks.start - 1)
    for tick in ticks:
        payload = pb.ArmState(sequence=tick, n_sections=1).SerializeToString()
        part.write(STATE, payload, START_NS + tick, tick)
    part.finish()
    return path


def session_of(folder: Path, name: str, numbers: list[int]) -> list[Path]:
    """Ten ticks a part, in the order of the parts."""
    return [
        write_part(part_path(folder, name, n), name, n, range(10 * at + 1, 10 * at + 11))
        for at, n in enumerate(numbers)
    ]


@pytest.mark.parametrize("numbers", [[0, 1], [0, 998, 999, 1000, 1001], [0, 9999, 10000]])
def test_every_part_is_found_in_the_order_of_its_number(tmp_path: Path, numbers: list[int]) -> None:
    paths = session_of(tmp_path, "20260102T000000Z-paper", numbers)
    session_of(tmp_path, "20260103T000000Z-paper", [0, 1])
    reader = LogReader(paths[0])
    assert reader.parts == paths
    assert reader.ticks()["sequence"].tolist() == list(range(1, 10 * len(numbers) + 1))
    assert parts_of(paths[1]) == [paths[1]]  # a later part is read alone


@pytest.mark.parametrize("name", NAMES)
def test_a_renamed_log_keeps_its_parts(tmp_path: Path, name: str) -> None:
    first, *rest = session_of(tmp_path, "20260102T000000Z-paper", [0, 1, 2])
    renamed = first.rename(tmp_path / name)
    assert LogReader(renamed).parts == [renamed, *rest]
    shuffled = random.Random(1).sample("xyz", 2)
    others = [part.rename(tmp_path / f"{n}.mcap") for part, n in zip(rest, shuffled, strict=True)]
    assert LogReader(renamed).parts == [renamed, *others]
    assert summarise(LogReader(renamed)).missing_ticks == 0


def test_a_copy_beside_a_log_counts_once(tmp_path: Path) -> None:
    first, second = session_of(tmp_path, "20260102T000000Z-paper", [0, 1])
    shutil.copy(first, tmp_path / "copy.mcap")
    shutil.copy(second, tmp_path / "another copy.mcap")
    for path in (first, tmp_path / "copy.mcap"):
        summary = summarise(LogReader(path))
        assert (summary.ticks, summary.messages["state"], summary.parts) == (20, 20, 2)


def test_a_log_whose_beginning_was_deleted_is_read_from_its_first_part(tmp_path: Path) -> None:
    first, *rest = session_of(tmp_path, "20260102T000000Z-paper", [0, 1, 2])
    first.unlink()
    summary = summarise(LogReader(rest[0]))
    assert (summary.parts, summary.ticks, summary.missing_ticks) == (2, 20, 10)


def test_what_else_lies_beside_a_log_does_not_matter(tmp_path: Path) -> None:
    (first,) = session_of(tmp_path, "20260102T000000Z-paper", [0])
    (tmp_path / "rubbish.mcap").write_bytes(bytes(3000))
    (tmp_path / "20260102T000000Z-paper.001.mcap").symlink_to(first)
    (tmp_path / "20260102T000000Z-paper.002.mcap").mkdir()
    with (tmp_path / "20260102T000000Z-paper.003.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_message(writer.register_channel("chatter", "json", 0), 1, b"{}", 1)
        writer.finish()
    assert LogReader(first).parts == [first]


def test_parts_from_before_the_channels_named_them_are_found_by_their_facts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Such parts have the path of the first file in their facts, and are ordered by time."""
    monkeypatch.setattr("pneuarm.logs.recording.part.SESSION", "x")
    monkeypatch.setattr("pneuarm.logs.recording.part.PART", "y")
    FACTS_THEN = pb.Info(arm="paper", log_path="/somewhere/20260102T000000Z-paper.mcap")
    monkeypatch.setattr("tests.logs.reading.test_parts.FACTS", FACTS_THEN)
    session = make_session(tmp_path, monkeypatch)
    paths = session_of(tmp_path, "20260102T000000Z-paper", [0, 999, 1000])
    renamed = paths[0].rename(tmp_path / "run [3].mcap")
    assert LogReader(renamed).parts == [renamed, *paths[1:]]
    assert session.status.missed == 0

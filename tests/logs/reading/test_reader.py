"""The reader takes our logs, tells what is in them, and refuses everything else in one sentence."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from mcap.writer import Writer

from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.reading import reader
from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.reading.summary import summarise
from pneuarm.logs.recording.part import Part
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import EVENT, INFO, STATE, TIP_POSE
from tools.rig.recording import INFO as FACTS
from tools.rig.recording import PERIOD_NS, START_NS, make_session


def refusal(path: Path) -> str:
    with pytest.raises(LogError) as caught:
        LogReader(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def write_log(path: Path, sequences: list[int], info: pb.Info | None = FACTS) -> Path:
    part = Part(path, "paper")
    if info is not None:
        part.write(INFO, info.SerializeToString(), START_NS)
    for sequence in sequences:
        state = pb.ArmState(sequence=sequence, time_unix_ns=START_NS + sequence, n_sections=1)
        part.write(STATE, state.SerializeToString(), START_NS + sequence, sequence)
    part.finish()
    return path


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "nothing.mcap"
    assert refusal(path) == f"{path} cannot be read: No such file or directory"
    assert "Is a directory" in refusal(tmp_path)


@pytest.mark.parametrize("content", [b"", b"\x89MCA", b"PK\x03\x04 a zip", bytes(100)])
def test_a_file_that_is_not_mcap_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "some.mcap"
    path.write_bytes(content)
    assert refusal(path) == f"{path} is not an MCAP file; a session log ends in .mcap"


def write_others(path: Path, topic: str, encoding: str) -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("thing", "jsonschema", b"{}")
        channel = writer.register_channel(topic, encoding, schema)
        writer.add_message(channel, 1, b'{"a": 1}', 1)
        writer.finish()
    return path


@pytest.mark.parametrize("topic", ["/chatter", "state", "other/paper/state", "pneuarm/paper/state"])
def test_an_mcap_file_of_somebody_else_is_refused(tmp_path: Path, topic: str) -> None:
    path = write_others(tmp_path / "others.mcap", topic, "json")
    assert f"{path} is an MCAP file, but not a session log of pneuarm" in refusal(path)


def test_a_message_that_is_none_is_told_and_the_next_is_read(tmp_path: Path) -> None:
    part = Part(tmp_path / "log.mcap", "paper")
    part.write(INFO, FACTS.SerializeToString(), 5)
    part.write(EVENT, b"\xff\xff\xff", 5)
    part.write(EVENT, pb.Event(text="next").SerializeToString(), 6)
    part.finish()
    reader = LogReader(tmp_path / "log.mcap")
    assert [e.message for e in reader if e.topic is EVENT] == [pb.Event(text="next")]
    assert [damage.path.name for damage in reader.damage] == ["log.mcap"]
    assert "event" in str(reader.damage[0])


def test_a_log_whose_facts_are_lost_is_read_and_says_so(tmp_path: Path) -> None:
    reader = LogReader(write_log(tmp_path / "log.mcap", [1, 2], info=None))
    assert (reader.info.arm, reader.n_sections, len(reader.ticks())) == ("paper", 1, 2)
    assert len(reader.damage) == 1
    assert "configuration" in str(reader.damage[0])


def test_messages_come_in_the_order_of_time(tmp_path: Path) -> None:
    part = Part(tmp_path / "log.mcap", "paper")
    part.write(INFO, FACTS.SerializeToString(), 5)
    part.write(EVENT, pb.Event(text="one").SerializeToString(), 7)
    part.write(TIP_POSE, PoseInFrame(frame_id="base").SerializeToString(), 6)
    part.write(EVENT, pb.Event(text="two").SerializeToString(), 8)
    part.finish()
    entries = [(e.topic, e.message, e.time_unix_ns) for e in LogReader(tmp_path / "log.mcap")]
    assert entries == [
        (INFO, FACTS, 5),
        (TIP_POSE, PoseInFrame(frame_id="base"), 6),
        (EVENT, pb.Event(text="one"), 7),
        (EVENT, pb.Event(text="two"), 8),
    ]


@pytest.mark.parametrize(
    ("sequences", "missing"),
    [([1, 2, 3], 0), ([1, 3, 4], 1), ([5, 6], 4), ([1, 2, 2, 3], 0), ([2, 1, 4], 1), ([], 0)],
)
def test_missing_ticks_are_counted_and_repeated_ones_are_not(
    tmp_path: Path, sequences: list[int], missing: int
) -> None:
    summary = summarise(LogReader(write_log(tmp_path / "log.mcap", sequences)))
    assert (summary.ticks, summary.missing_ticks) == (len(set(sequences)), missing)


def test_the_summary_of_a_session_of_many_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = make_session(tmp_path, monkeypatch)
    session.configure(roll_bytes=1)
    recorder = session.recorder()
    for _ in range(3):
        session.write_ticks(50)
        session.write_events(2)
        session.flush(recorder)
    broken = summarise(LogReader(session.path))
    assert not broken.finished
    recorder.finish()
    summary = summarise(LogReader(session.path))
    assert (summary.arm, summary.parts, summary.finished) == ("paper", 4, True)
    assert summary.path == str(session.path)
    assert summary.start_unix_ns == START_NS
    assert summary.end_unix_ns == START_NS + 149 * PERIOD_NS
    assert (summary.messages["event"], summary.messages["state"]) == (6, 150)
    assert summary.size_bytes == sum(path.stat().st_size for path in tmp_path.glob("*.mcap"))


def test_ticks_are_all_ticks_in_one_array(tmp_path: Path) -> None:
    reader = LogReader(write_log(tmp_path / "log.mcap", [4, 5, 6]))
    assert reader.n_sections == 1
    assert reader.ticks()["sequence"].tolist() == [4, 5, 6]
    assert reader.ticks()["time_unix_ns"].tolist() == [START_NS + n for n in (4, 5, 6)]


@pytest.mark.parametrize("step_ns", [-1, 0])
def test_time_that_goes_back_all_along_fills_no_memory(
    monkeypatch: pytest.MonkeyPatch, step_ns: int
) -> None:
    monkeypatch.setattr(reader, "_MOST_HELD_BYTES", 100_000)
    taken = 0

    def messages() -> Iterator[reader.Raw]:
        nonlocal taken
        for number in range(2000):
            taken += 1
            yield reader.Raw(STATE, bytes(600), 10**18 + number * step_ns)

    given = 0
    for _ in reader._in_time_order(messages()):
        given += 1
        assert given == 2000 or taken - given <= 100
    assert given == 2000

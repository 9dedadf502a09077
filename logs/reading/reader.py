"""Reading a session back: whole or broken off, one part or many."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from google.protobuf.message import DecodeError, Message
from mcap.records import Channel
from mcap.records import Message as McapMessage
from mcap.well_known import MessageEncoding
from mcap.writer import MCAP0_MAGIC

from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.recording.session import is_finished, parts_of, whole_records
from pneuarm.logs.rings.tick import ticks_from_states
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import LOGGED, STATE, Topic, split_key

_BY_KEY = {topic.key: topic for topic in LOGGED}


@dataclass(frozen=True)
class Entry:
    """One message of a log."""

    topic: Topic
    message: Message
    time_unix_ns: int


class LogReader:
    """Iterates over the messages of a session in the order of the file."""

    def __init__(self, path: Path) -> None:
        """Open the session that starts with ``path``; raises LogError if it is not one of ours."""
        try:
            with path.open("rb") as file:
                magic = file.read(len(MCAP0_MAGIC))
        except OSError as error:
            raise LogError(f"{path} cannot be read: {error.strerror}") from error
        if magic != MCAP0_MAGIC:
            raise LogError(f"{path} is not an MCAP file; a session log ends in .mcap")
        self.parts = parts_of(path)
        self.info = self._first_info()

    def _first_info(self) -> pb.Info:
        for entry in self:
            if isinstance(entry.message, pb.Info):
                return entry.message
            break
        raise LogError(f"{self.parts[0]} is an MCAP file, but not a session log of pneuarm")

    @property
    def finished(self) -> bool:
        """Say whether every part was closed properly."""
        return all(is_finished(part) for part in self.parts)

    def __iter__(self) -> Iterator[Entry]:
        """Yield every message of our topics."""
        for part in self.parts:
            yield from self._entries(part)

    def _entries(self, part: Path) -> Iterator[Entry]:
        topics: dict[int, Topic] = {}
        for record in whole_records(part):
            if isinstance(record, Channel):
                topic = _BY_KEY.get(split_key(record.topic)[1])
                if topic is not None and record.message_encoding == MessageEncoding.Protobuf:
                    topics[record.id] = topic
            elif isinstance(record, McapMessage) and record.channel_id in topics:
                topic = topics[record.channel_id]
                if topic.message is not None:
                    message = topic.message()
                    try:
                        message.ParseFromString(record.data)
                    except DecodeError as error:
                        raise LogError(f"{part} is damaged: no message at {topic.key}") from error
                    yield Entry(topic, message, record.log_time)

    @property
    def n_sections(self) -> int:
        """Number of sections of the arm."""
        return len(self.info.bend_max_rad)

    def ticks(self) -> np.ndarray:
        """All ticks as one structured array, in order; see :mod:`pneuarm.logs.rings.tick`."""
        states = [entry.message for entry in self if isinstance(entry.message, pb.ArmState)]
        return ticks_from_states(states, self.n_sections)


@dataclass
class LogSummary:
    """What `pneuarm info` says of a log."""

    path: str
    parts: int
    finished: bool
    arm: str
    start_unix_ns: int = 0
    end_unix_ns: int = 0
    size_bytes: int = 0
    ticks: int = 0
    missing_ticks: int = 0
    messages: dict[str, int] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)


def summarise(reader: LogReader) -> LogSummary:
    """Count what is in a log, and which ticks are missing between its first and last."""
    summary = LogSummary(str(reader.parts[0]), len(reader.parts), reader.finished, reader.info.arm)
    summary.versions = dict(reader.info.versions)
    summary.size_bytes = sum(part.stat().st_size for part in reader.parts)
    seen: set[int] = set()
    for entry in reader:
        key = entry.topic.key
        summary.messages[key] = summary.messages.get(key, 0) + 1
        if entry.topic is STATE and isinstance(entry.message, pb.ArmState):
            seen.add(entry.message.sequence)
            summary.start_unix_ns = summary.start_unix_ns or entry.time_unix_ns
            summary.end_unix_ns = max(summary.end_unix_ns, entry.time_unix_ns)
    summary.ticks = len(seen)
    # Ticks are numbered from 1, so a log that starts later lacks its beginning too.
    summary.missing_ticks = max(seen) - len(seen) if seen else 0
    return summary

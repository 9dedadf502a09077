"""What is in a log, and what is missing: counted over every checked chunk, to the end of the file.

What a closed file says of itself counts only where its checksum is right.
"""

from dataclasses import dataclass, field
from pathlib import Path

from mcap.records import ChunkIndex

from pneuarm.logs.reading.reader import LogReader, Topics
from pneuarm.logs.reading.walk import GoodChunk, GoodRecord, Piece, Stored, Summary, read_summary
from pneuarm.logs.schema.topics import STATE

#: Of a MessageIndex: its head, and one entry of it.
_INDEX_HEAD_BYTES, _INDEX_ENTRY_BYTES = 15, 16


@dataclass
class LogSummary:
    """What `pneuarm info` says of a log.

    ``missing_ticks`` are those between the first of the session and the last of which the file
    knows. ``lost`` counts messages a key that the file says it has and that cannot be read.
    """

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
    damage: list[str] = field(default_factory=list)
    damaged_bytes: int = 0
    lost: dict[str, int] = field(default_factory=dict)
    cut_bytes: int = 0


class Numbers:
    """A set of numbers that come mostly one after another; its size is that of its gaps."""

    def __init__(self) -> None:
        self._runs: list[list[int]] = []

    def add(self, number: int) -> None:
        """Add one; it may be there already."""
        if self._runs and self._runs[-1][1] + 1 == number:
            self._runs[-1][1] = number
        else:
            self._runs.append([number, number])

    def count_and_last(self) -> tuple[int, int]:
        """Return how many there are, and the highest; 0 for both where there is none."""
        count = last = 0
        for low, high in sorted(self._runs):
            count += max(0, high - max(low - 1, last))
            last = max(last, high)
        return count, last


def summarise(reader: LogReader) -> LogSummary:
    """Count what is in a log, and which ticks are missing from the first to the last."""
    summary = LogSummary(str(reader.parts[0]), len(reader.parts), reader.finished, reader.info.arm)
    summary.versions = dict(reader.info.versions)
    summary.size_bytes = sum(part.stat().st_size for part in reader.parts)
    numbers, behind = Numbers(), 0
    for part in reader.parts:
        ticks_before = summary.messages.get(STATE.key, 0)
        lost = _add_part(summary, numbers, reader, part)
        behind = lost + (behind if summary.messages.get(STATE.key, 0) == ticks_before else 0)
    summary.ticks, last = numbers.count_and_last()
    # Ticks are numbered from 1, so a log that starts later lacks its beginning too.
    summary.missing_ticks = last - summary.ticks + behind
    for damage in reader.damage:
        if damage.cut:
            summary.cut_bytes += damage.end - damage.begin
        else:
            summary.damage.append(str(damage))
            summary.damaged_bytes += damage.end - damage.begin
    return summary


def _add_part(summary: LogSummary, numbers: Numbers, reader: LogReader, part: Path) -> int:
    """Count one part; return how many ticks it lost behind the last that can be read."""
    counts: dict[int, int] = {}
    topics: Topics = {}
    spans: set[tuple[int, int]] = set()
    for piece, topics in reader.pieces(part):
        messages = _messages(piece)
        for message in messages:
            counts[message.channel] = counts.get(message.channel, 0) + 1
            if topics.get(message.channel) is STATE:
                numbers.add(_tick_number(message.payload))
                summary.start_unix_ns = summary.start_unix_ns or message.time_ns
                summary.end_unix_ns = max(summary.end_unix_ns, message.time_ns)
        if messages:
            times = [message.time_ns for message in messages]
            spans.add((min(times), max(times)))
    for channel, count in counts.items():
        _count(summary.messages, topics, channel, count)
    told = read_summary(part)
    if told is None:
        return 0
    for channel, count in told.counts.items():
        _count(summary.lost, topics, channel, count - counts.get(channel, 0))
    return _behind(told, spans, topics)


def _messages(piece: Piece) -> "list[Stored]":
    if isinstance(piece, GoodChunk):
        return piece.messages
    if isinstance(piece, GoodRecord) and isinstance(piece.record, Stored):
        return [piece.record]
    return []


def _count(into: dict[str, int], topics: Topics, channel: int, count: int) -> None:
    topic = topics.get(channel)
    if topic is not None and count > 0:
        into[topic.key] = into.get(topic.key, 0) + count


def _tick_number(payload: bytes) -> int:
    """Return the first field of an ArmState, its number, without decoding the rest."""
    number = shift = 0
    if payload[:1] != b"\x08":
        return 0
    for byte in payload[1:11]:
        number |= (byte & 0x7F) << shift
        if byte < 0x80:
            break
        shift += 7
    return number


def _behind(told: Summary, spans: set[tuple[int, int]], topics: Topics) -> int:
    """Ticks of the last chunks that cannot be read: no gap between others shows them."""
    lost = 0
    for index in sorted(told.chunks, key=lambda index: -index.chunk_start_offset):
        ticks = sum(n for channel, n in _indexed(index).items() if topics.get(channel) is STATE)
        if (index.message_start_time, index.message_end_time) in spans:
            if ticks:
                break
        else:
            lost += ticks
    return lost


def _indexed(index: ChunkIndex) -> dict[int, int]:
    """How many messages of each channel a chunk has: the lengths of its indexes say it."""
    offsets = sorted((offset, channel) for channel, offset in index.message_index_offsets.items())
    end = index.chunk_start_offset + index.chunk_length + index.message_index_length
    ends = [*(offset for offset, _ in offsets[1:]), end]
    return {
        channel: (after - offset - _INDEX_HEAD_BYTES) // _INDEX_ENTRY_BYTES
        for (offset, channel), after in zip(offsets, ends, strict=False)
    }

"""Reading a session back: whole, broken off or damaged, one part or many."""

import heapq
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import cast

import numpy as np
from google.protobuf.message import DecodeError, Message
from mcap.records import Channel
from mcap.writer import MCAP0_MAGIC

from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.reading.parts import parts_of, topic_of
from pneuarm.logs.reading.walk import (
    Damage,
    GoodChunk,
    GoodRecord,
    Piece,
    Stored,
    data_is_right,
    read_summary,
    walk,
)
from pneuarm.logs.rings.rings import HOLD_S
from pneuarm.logs.rings.tick import fits, tick_dtype, ticks_from_states
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import INFO, STATE, Topic, split_key

#: A recorder that lags writes events ahead of the ticks of their time, by a ring at most.
_OUT_OF_ORDER_NS = int(1.2 * HOLD_S * 1e9)

#: Messages that are held until it is their turn: where time stands still, or goes back all along,
#: it never is. An arm of three sections at 1 kHz needs a half of it. A message has so much besides.
_MOST_HELD_BYTES, _RAW_BYTES = 128 * 1024 * 1024, 400

#: What the numbers of a file's channels mean; None for a channel of somebody else.
Topics = dict[int, Topic | None]

#: Ticks that are decoded at once.
_BATCH = 1000


@dataclass(frozen=True)
class Entry:
    """One message of a log."""

    topic: Topic
    message: Message
    time_unix_ns: int


@dataclass(frozen=True)
class Raw:
    """One message of a log as bytes."""

    topic: Topic
    payload: bytes
    time_unix_ns: int


class LogReader:
    """Reads the messages of a session; what is damaged is left out, and told in ``damage``."""

    def __init__(self, path: Path) -> None:
        """Open the session that starts with ``path``; raises LogError if it is not one of ours."""
        self.parts = parts_of(path)
        self._damage: dict[Damage, None] = {}
        self.info = self._first_info()

    def _first_info(self) -> pb.Info:
        """Return the facts; of those whose every copy is lost, what the channels know."""
        arm = ""
        for part in self.parts:
            for piece, topics in self.pieces(part):
                for raw in _ours(piece, topics):
                    if raw.topic is INFO and (info := _parsed(raw)) is not None:
                        return cast("pb.Info", info)
                arm = arm or _arm_of(piece)
        if not arm:
            raise LogError(_not_ours(self.parts[0]))
        self._tell(Damage(self.parts[0], 0, 0, "the facts of the session (its configuration)"))
        return pb.Info(arm=arm)

    @property
    def finished(self) -> bool:
        """Say whether every part was closed properly, with its summary whole."""
        return all(read_summary(part) is not None for part in self.parts)

    @property
    def damage(self) -> list[Damage]:
        """What was damaged, as far as the log has been read until now."""
        return list(self._damage)

    def __iter__(self) -> Iterator[Entry]:
        """Yield every message of our topics in the order of time."""
        for raw in _in_time_order(self.raw()):
            message = self._message(raw)
            if message is not None:
                yield Entry(raw.topic, message, raw.time_unix_ns)

    def _message(self, raw: Raw) -> Message | None:
        message = _parsed(raw)
        if message is None:
            self._tell(Damage(self.parts[0], 0, 0, f"a message at {raw.topic.key} cannot be read"))
        n_sections = len(self.info.bend_max_rad)
        if isinstance(message, pb.ArmState) and n_sections and not fits(message, n_sections):
            what = f"a state that is not of {n_sections} sections, as the arm of this log is"
            self._tell(Damage(self.parts[0], 0, 0, what))
            return None
        return message

    def raw(self) -> Iterator[Raw]:
        """Yield every message of our topics as bytes, in the order of the file."""
        for part in self.parts:
            for piece, topics in self.pieces(part):
                yield from _ours(piece, topics)

    def pieces(self, part: Path) -> Iterator[tuple[Piece, Topics]]:
        """Yield chunks, records and damage of one part, each with the channels known by then."""
        summary = read_summary(part)
        topics: Topics = {}
        if summary is not None:
            _learn(topics, summary.channels.values())
        loose = False
        for piece in walk(part):
            if isinstance(piece, Damage):
                self._tell(piece)
            elif isinstance(piece, GoodChunk):
                _learn(topics, piece.named)
                nameless = sum(message.channel not in topics for message in piece.messages)
                if nameless:
                    what = f"{nameless} messages whose channels stood where the damage is"
                    self._tell(Damage(part, piece.offset, piece.offset + len(piece.raw), what))
            else:
                if isinstance(piece.record, Channel):  # which no checksum covers
                    topics.setdefault(piece.record.id, topic_of(piece.record))
                if isinstance(piece.record, Stored) and not loose:
                    loose = True
                    self._tell_if_unchecked(part, piece.offset)
            yield piece, topics

    def _tell_if_unchecked(self, part: Path, offset: int) -> None:
        """Outside of chunks only the checksum of all data covers a message, where there is one."""
        if not data_is_right(part):
            what = "messages outside of chunks, without a checksum that is right: unchecked"
            self._tell(Damage(part, offset, offset, what))

    def _tell(self, damage: Damage) -> None:
        self._damage.setdefault(damage)

    @property
    def n_sections(self) -> int:
        """Number of sections of the arm."""
        if self.info.bend_max_rad:
            return len(self.info.bend_max_rad)
        first = next(self._states(), None)
        return first.n_sections if first is not None else 1

    def _states(self) -> Iterator[pb.ArmState]:
        for raw in self.raw():
            if raw.topic is STATE:
                state = self._message(raw)
                if state is not None:
                    yield cast("pb.ArmState", state)

    def tick_batches(self) -> Iterator[np.ndarray]:
        """Yield the ticks in arrays of at most a thousand, in the order of the file."""
        states, n_sections = self._states(), self.n_sections
        while batch := list(islice(states, _BATCH)):
            yield ticks_from_states(batch, n_sections)

    def ticks(self, names: Sequence[str] | None = None) -> np.ndarray:
        """All ticks as one structured array, in order, each once; see `pneuarm.logs.rings.tick`.

        An hour of a whole tick takes gigabytes: ``names`` are the only fields that are kept.
        """
        whole = tick_dtype(self.n_sections)
        wanted = whole.names or () if names is None else dict.fromkeys(("sequence", *names))
        at_most = sum(raw.topic is STATE for raw in self.raw())
        ticks = np.zeros(at_most, dtype=[(name, whole[name]) for name in wanted])
        count = 0
        for batch in self.tick_batches():
            batch = batch[: at_most - count]  # a log that is being written has more by now
            for name in wanted:
                ticks[name][count : count + len(batch)] = batch[name]
            count += len(batch)
        ticks = ticks[:count]
        numbers = ticks["sequence"]
        if (numbers[1:] > numbers[:-1]).all():
            return ticks
        return ticks[np.unique(numbers, return_index=True)[1]]


def _learn(topics: Topics, records: Iterable[object]) -> None:
    topics.update({r.id: topic_of(r) for r in records if isinstance(r, Channel)})


def _parsed(raw: Raw) -> Message | None:
    """Return the message, None where the bytes are none, however right their checksum is."""
    message = raw.topic.message() if raw.topic.message is not None else None
    if message is not None:
        try:
            message.ParseFromString(raw.payload)
        except DecodeError:
            return None
    return message


def _ours(piece: Piece, topics: Topics) -> Iterator[Raw]:
    messages: Iterable[Stored] = ()
    if isinstance(piece, GoodChunk):
        messages = piece.messages
    elif isinstance(piece, GoodRecord) and isinstance(piece.record, Stored):
        messages = (piece.record,)
    for message in messages:
        topic = topics.get(message.channel)
        if topic is not None:
            yield Raw(topic, message.payload, message.time_ns)


def _arm_of(piece: Piece) -> str:
    """Return the arm that a channel of ours names, empty where there is none."""
    records: Sequence[object] = ()
    if isinstance(piece, GoodChunk):
        records = piece.named
    elif isinstance(piece, GoodRecord):
        records = (piece.record,)
    channels = [record for record in records if isinstance(record, Channel)]
    return next((split_key(c.topic)[0] for c in channels if topic_of(c) is not None), "")


def _not_ours(path: Path) -> str:
    with path.open("rb") as file:
        if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            return f"{path} is not an MCAP file; a session log ends in .mcap"
    return f"{path} is an MCAP file, but not a session log of pneuarm, or nothing of it is readable"


def _in_time_order(messages: Iterable[Raw]) -> Iterator[Raw]:
    """Sort what is out of order by some seconds, holding no more than these, and no more bytes."""
    waiting: list[tuple[int, int, Raw]] = []
    held_bytes = 0
    for number, raw in enumerate(messages):
        heapq.heappush(waiting, (raw.time_unix_ns, number, raw))
        held_bytes += _RAW_BYTES + len(raw.payload)
        while waiting[0][0] < raw.time_unix_ns - _OUT_OF_ORDER_NS or held_bytes > _MOST_HELD_BYTES:
            earliest = heapq.heappop(waiting)[2]
            held_bytes -= _RAW_BYTES + len(earliest.payload)
            yield earliest
    while waiting:
        yield heapq.heappop(waiting)[2]

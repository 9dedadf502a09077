"""The rings of one daemon: ticks, and messages from each process that has something to say."""

import struct
from dataclasses import dataclass, field
from multiprocessing.context import SpawnContext

from google.protobuf.message import Message

from pneuarm.logs.rings.ring import RingMemory, RingReader, RingWriter
from pneuarm.logs.rings.tick import tick_dtype
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import LOGGED, Topic

#: Every ring holds at least this long, so that a recorder that stood still loses nothing.
HOLD_S = 30.0
_MESSAGE_BYTES = 1008
_MESSAGES = 32768
_EVENTS = 4096
_HEADER = struct.Struct("<HqBB")  # index in LOGGED, time, this part's number, how many follow

#: A longer message lies in several records, one after another. No message on the wire needs more.
_MOST_PARTS = 255

#: Longest text of an event where a whole one does not fit, so that the event itself does.
_SHORT_BYTES = 250


@dataclass(frozen=True)
class Rings:
    """Shared memory of all rings; every one has a single writing process."""

    ticks: RingMemory
    control: RingMemory
    gateway: RingMemory
    supervisor: RingMemory

    @classmethod
    def create(cls, context: SpawnContext, n_sections: int, rate_hz: float) -> "Rings":
        """Make the rings for an arm; the tick ring holds HOLD_S seconds and a tenth more."""
        capacity = int(1.1 * HOLD_S * rate_hz)
        return cls(
            RingMemory.create(context, capacity, tick_dtype(n_sections).itemsize),
            RingMemory.create(context, _EVENTS, _MESSAGE_BYTES),
            RingMemory.create(context, _MESSAGES, _MESSAGE_BYTES),
            RingMemory.create(context, _EVENTS, _MESSAGE_BYTES),
        )

    def messages(self) -> tuple[RingMemory, ...]:
        """Return the rings that carry messages."""
        return (self.control, self.gateway, self.supervisor)


class MessageWriter:
    """Writes messages of logged topics into a ring."""

    def __init__(self, memory: RingMemory) -> None:
        self._ring = RingWriter(memory)
        self._part_bytes = memory.payload_bytes - _HEADER.size

    def write(self, topic: Topic, message: Message, time_unix_ns: int) -> None:
        """Write one message; raises ValueError if it is longer than 255 records.

        The texts of an event are cut to fit into one: they may hold anything, and the event must
        arrive.
        """
        if isinstance(message, pb.Event) and message.ByteSize() > self._part_bytes:
            message = _shortened(message)
        index, size, payload = LOGGED.index(topic), self._part_bytes, message.SerializeToString()
        n_parts = max(1, -(-len(payload) // size))
        if n_parts > _MOST_PARTS:
            raise ValueError(f"message of {len(payload)} bytes; at most {_MOST_PARTS * size}")
        for part in range(n_parts):
            header = _HEADER.pack(index, time_unix_ns, part, n_parts - 1 - part)
            self._ring.write(header + payload[part * size : (part + 1) * size])


def _shortened(event: pb.Event) -> pb.Event:
    short = pb.Event()
    short.CopyFrom(event)
    short.text, short.cause = _cut(event.text, _SHORT_BYTES), _cut(event.cause, _SHORT_BYTES)
    short.remedy, short.client_id = _cut(event.remedy, 100), _cut(event.client_id, 64)
    short.payload = event.payload[:100]
    return short


def _cut(text: str, size: int) -> str:
    return text.encode()[:size].decode(errors="ignore")


class _Joiner:
    """Reads one ring and joins messages that lie in several records."""

    def __init__(self, memory: RingMemory, next_sequence: int) -> None:
        self._ring = RingReader(memory, next_sequence)
        self._parts: list[bytes] = []
        self._left = 0  # parts that are still to come
        self._dropped = 0

    def read(self) -> list[tuple[Topic, bytes, int]]:
        found = []
        for _, record in self._ring.read(4096):
            index, time_unix_ns, part, left = _HEADER.unpack_from(record)
            if not self._continues(part, left):
                continue
            self._parts.append(record[_HEADER.size :])
            self._left = left
            if left == 0:
                found.append((LOGGED[index], b"".join(self._parts), time_unix_ns))
                self._parts = []
        return found

    def _continues(self, part: int, left: int) -> bool:
        """Say whether a part comes next; what it leaves incomplete, or itself, is dropped.

        A message stays incomplete when its writer died, or when this reader was lapped.
        """
        if part == len(self._parts) and (part == 0 or left == self._left - 1):
            return True
        self._dropped += len(self._parts) + (part > 0)
        self._parts = []
        return part == 0

    @property
    def missed(self) -> int:
        return self._ring.missed + self._dropped

    @property
    def next_sequence(self) -> int:
        """Where the first message begins that has not been given out."""
        return self._ring.next_sequence - len(self._parts)


@dataclass
class MessageReader:
    """Reads messages from several rings, each in its order."""

    memories: tuple[RingMemory, ...]
    positions: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Start at the given positions, or at the beginning."""
        starts = self.positions or [1] * len(self.memories)
        self._rings = [
            _Joiner(memory, start) for memory, start in zip(self.memories, starts, strict=True)
        ]

    def read(self) -> list[tuple[Topic, bytes, int]]:
        """Return what is new as (topic, payload, time_unix_ns)."""
        return [message for ring in self._rings for message in ring.read()]

    @property
    def missed(self) -> int:
        """Records that were overwritten before they were read, or belong to no whole message."""
        return sum(ring.missed for ring in self._rings)

    def next_sequences(self) -> list[int]:
        """Return where to go on reading, one number a ring."""
        return [ring.next_sequence for ring in self._rings]

"""The rings of one daemon: ticks, and messages from each process that has something to say."""

import struct
from dataclasses import dataclass, field
from multiprocessing.context import SpawnContext

from google.protobuf.message import Message

from logs.ring import RingMemory, RingReader, RingWriter
from logs.schema import pneuarm_pb2 as pb
from logs.tick import tick_dtype
from logs.topics import LOGGED, Topic

#: Every ring holds at least this long, so that a recorder that stood still loses nothing.
HOLD_S = 30.0
_MESSAGE_BYTES = 1008
_MESSAGES = 32768
_EVENTS = 4096
_HEADER = struct.Struct("<Hq")  # index in LOGGED, time

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

    def write(self, topic: Topic, message: Message, time_unix_ns: int) -> None:
        """Write one message; raises ValueError if it is longer than a record.

        The texts of an event are cut to fit: they may hold anything, and the event must arrive.
        """
        if isinstance(message, pb.Event) and message.ByteSize() > _MESSAGE_BYTES - _HEADER.size:
            message = _shortened(message)
        header = _HEADER.pack(LOGGED.index(topic), time_unix_ns)
        self._ring.write(header + message.SerializeToString())


def _shortened(event: pb.Event) -> pb.Event:
    short = pb.Event()
    short.CopyFrom(event)
    short.text, short.cause = _cut(event.text, _SHORT_BYTES), _cut(event.cause, _SHORT_BYTES)
    short.remedy, short.client_id = _cut(event.remedy, 100), _cut(event.client_id, 64)
    short.payload = event.payload[:100]
    return short


def _cut(text: str, size: int) -> str:
    return text.encode()[:size].decode(errors="ignore")


@dataclass
class MessageReader:
    """Reads messages from several rings, each in its order."""

    memories: tuple[RingMemory, ...]
    positions: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Start at the given positions, or at the beginning."""
        starts = self.positions or [1] * len(self.memories)
        self._readers = [
            RingReader(memory, start) for memory, start in zip(self.memories, starts, strict=True)
        ]

    def read(self) -> list[tuple[Topic, bytes, int]]:
        """Return what is new as (topic, payload, time_unix_ns)."""
        found = []
        for reader in self._readers:
            for _, record in reader.read(4096):
                index, time_unix_ns = _HEADER.unpack_from(record)
                found.append((LOGGED[index], record[_HEADER.size :], time_unix_ns))
        return found

    @property
    def missed(self) -> int:
        """Records that were overwritten before they were read."""
        return sum(reader.missed for reader in self._readers)

    def next_sequences(self) -> list[int]:
        """Return where to go on reading, one number a ring."""
        return [reader.next_sequence for reader in self._readers]

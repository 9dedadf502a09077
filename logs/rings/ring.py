"""Rings of fixed-size records in shared memory: one writer, any number of readers.

The writer never waits and never knows its readers. A record carries its sequence number and a
checksum over both, so a reader sees a torn or overwritten record for what it is on any processor;
a reader that was lapped knows how many records it missed. The memory is anonymous and shared by
inheritance: nothing is left behind when every process has gone, however it went.
"""

import ctypes
import struct
import zlib
from dataclasses import dataclass
from multiprocessing.context import SpawnContext
from multiprocessing.sharedctypes import RawArray

_SLOT = struct.Struct("<QII")  # sequence number, payload length, checksum
_HEAD = struct.Struct("@Q")  # native: one store of 8 bytes, never seen or left half written
_CACHE_LINE = 64


@dataclass(frozen=True)
class RingMemory:
    """Shared memory of one ring; hand it to child processes as an argument."""

    raw: "ctypes.Array[ctypes.c_char]"
    capacity: int
    slot_bytes: int

    @classmethod
    def create(cls, context: SpawnContext, capacity: int, payload_bytes: int) -> "RingMemory":
        """Make an empty ring of ``capacity`` records of at most ``payload_bytes`` each."""
        slot_bytes = -(-(_SLOT.size + payload_bytes) // _CACHE_LINE) * _CACHE_LINE
        raw: ctypes.Array[ctypes.c_char] = RawArray(
            ctypes.c_char, _CACHE_LINE + capacity * slot_bytes
        )
        return cls(raw, capacity, slot_bytes)

    @property
    def payload_bytes(self) -> int:
        """Largest payload of a record."""
        return self.slot_bytes - _SLOT.size

    def view(self) -> memoryview:
        """Return the bytes of the ring."""
        return memoryview(self.raw).cast("B")

    def offset(self, sequence: int) -> int:
        """Where the record with this number lies."""
        return _CACHE_LINE + (sequence % self.capacity) * self.slot_bytes


class RingWriter:
    """The one writer of a ring. Sequence numbers start at 1 and have no gap.

    A writer that follows a dead one goes on counting where that one stopped.
    """

    def __init__(self, memory: RingMemory) -> None:
        self._memory = memory
        self._view = memory.view()
        self.last_sequence: int = _HEAD.unpack_from(self._view, 0)[0]

    def write(self, payload: bytes | memoryview) -> int:
        """Write one record and return its number; raises ValueError if it is too long."""
        size = len(payload)
        if size > self._memory.payload_bytes:
            raise ValueError(f"record of {size} bytes; at most {self._memory.payload_bytes}")
        sequence = self.last_sequence + 1
        offset = self._memory.offset(sequence)
        start = offset + _SLOT.size
        self._view[start : start + size] = payload
        checksum = zlib.crc32(payload, sequence & 0xFFFFFFFF)
        _SLOT.pack_into(self._view, offset, sequence, size, checksum)
        _HEAD.pack_into(self._view, 0, sequence)
        self.last_sequence = sequence
        return sequence


class RingReader:
    """One reader with its own position. ``missed`` counts what was overwritten before it came."""

    #: A lapped reader goes on this share of the ring behind the writer, out of its way.
    _REJOIN = 7 / 8

    def __init__(self, memory: RingMemory, next_sequence: int = 1) -> None:
        self._memory = memory
        self._view = memory.view()
        self.next_sequence = next_sequence
        self.missed = 0

    def head(self) -> int:
        """Return the number of the newest record, 0 before the first."""
        (sequence,) = _HEAD.unpack_from(self._view, 0)
        return int(sequence)

    @property
    def behind(self) -> int:
        """How many records have been written that were not read yet."""
        return self.head() + 1 - self.next_sequence

    def skip_to(self, sequence: int) -> int:
        """Go on with the given record; return how many were skipped, without counting a loss."""
        skipped = max(0, sequence - self.next_sequence)
        self.next_sequence += skipped
        return skipped

    def read(self, at_most: int) -> list[tuple[int, bytes]]:
        """Return up to ``at_most`` new records in order, as (sequence number, payload)."""
        records: list[tuple[int, bytes]] = []
        head = self.head()
        self._rejoin(head)
        while self.next_sequence <= head and len(records) < at_most:
            payload = self.record(self.next_sequence)
            if payload is None:
                if not self._rejoin(self.head()):
                    break  # being written just now: next time
                continue
            records.append((self.next_sequence, payload))
            self.next_sequence += 1
        return records

    def _rejoin(self, head: int) -> bool:
        """If the writer has lapped this reader, jump forward and count what was missed."""
        if head - self.next_sequence < self._memory.capacity:
            return False
        rejoin = head - int(self._memory.capacity * self._REJOIN)
        self.missed += rejoin - self.next_sequence
        self.next_sequence = rejoin
        return True

    def record(self, sequence: int) -> bytes | None:
        """Return the payload of one record, or None if it is not, or no longer, whole."""
        offset = self._memory.offset(sequence)
        found, size, checksum = _SLOT.unpack_from(self._view, offset)
        if found != sequence or size > self._memory.payload_bytes:
            return None
        start = offset + _SLOT.size
        payload = bytes(self._view[start : start + size])
        whole = zlib.crc32(payload, sequence & 0xFFFFFFFF) == checksum
        return payload if whole else None

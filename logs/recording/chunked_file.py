"""An MCAP file that stands damage: every chunk is checksummed and says whose it is by itself.

The records are the MCAP library's; its writer is not used because it names a channel only once, so
that with one damaged chunk all that follow mean nothing, and because it cannot change compression.
"""

import struct
import zlib
from dataclasses import dataclass, field
from typing import Protocol

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

_HEAD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<BQHIQQ")
_MESSAGE_BYTES = _MESSAGE.size - _HEAD.size
_MESSAGE_INDEX = struct.Struct("<BQHI")
#: What the footer's checksum covers of the footer itself.
_FOOTER_BEGIN = struct.Struct("<BQQQ")
_FOOTER_BYTES = 20

#: The number of a message in its channel has 32 bits in the file, and comes round.
_SEQUENCE_MASK = 0xFFFFFFFF


class Output(Protocol):
    """Where the bytes go."""

    def write(self, data: bytes) -> int:
        """Take bytes."""

    def tell(self) -> int:
        """Return how many were taken until now."""


def to_bytes(*records: McapRecord) -> bytes:
    """Return records as they stand in a file."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())


@dataclass
class _Open:
    """The chunk in progress: its messages, and where those of each channel begin."""

    data: bytearray = field(default_factory=bytearray)
    index: dict[int, list[int]] = field(default_factory=dict)  # time, offset, time, offset...


class _Indexes:
    """The index of every chunk, as it will stand in the summary; small, for days of recording."""

    def __init__(self) -> None:
        self._zlib, self._packed = zlib.compressobj(1), bytearray()
        self.number = self.start_ns = self.end_ns = 0

    def add(self, index: ChunkIndex) -> None:
        """Take the next one."""
        self._packed += self._zlib.compress(to_bytes(index))
        first, last = index.message_start_time, index.message_end_time
        self.start_ns = min(self.start_ns, first) if self.number else first
        self.end_ns = max(self.end_ns, last)
        self.number += 1

    def end(self) -> bytes:
        """Return them all, once."""
        return zlib.decompress(bytes(self._packed) + self._zlib.flush())


class ChunkedFile:
    """Writes one MCAP file: chunks with their channels, indexes, and a checksummed summary."""

    def __init__(self, output: Output) -> None:
        self._output = output
        self._data_crc = 0
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._written_schemas: set[int] = set()
        self._chunk_indexes = _Indexes()
        self._metadata_indexes: list[MetadataIndex] = []
        self._counts: dict[int, int] = {}
        self._open = _Open()
        self._write(MCAP0_MAGIC + to_bytes(Header("", "pneuarm")))

    def _write(self, data: bytes) -> None:
        self._data_crc = zlib.crc32(data, self._data_crc)
        self._output.write(data)

    def register(self, *records: Schema | Channel) -> None:
        """Make channels and schemas known; they are written with the first of their messages."""
        for record in records:
            if isinstance(record, Schema):
                self._schemas[record.id] = record
            else:
                self._channels[record.id] = record

    def add_message(self, channel: int, time_ns: int, payload: bytes, sequence: int) -> None:
        """Add a message to the chunk in progress."""
        data = self._open.data
        self._open.index.setdefault(channel, []).extend((time_ns, len(data)))
        size = _MESSAGE_BYTES + len(payload)
        number = sequence & _SEQUENCE_MASK
        data += _MESSAGE.pack(Opcode.MESSAGE, size, channel, number, time_ns, time_ns)
        data += payload

    @property
    def open_bytes(self) -> int:
        """Size of the chunk in progress."""
        return len(self._open.data)

    def end_chunk(self, compress: bool) -> None:
        """Write the chunk in progress, with the channels of its messages before them."""
        if not self._open.index:
            return
        open_, self._open = self._open, _Open()
        before = self._named(open_.index)
        content = before + bytes(open_.data)
        index = {channel: _moved(entries, len(before)) for channel, entries in open_.index.items()}
        times = [time_ns for entries in index.values() for time_ns in entries[::2]]
        chunk = Chunk(
            compression="zstd" if compress else "",
            data=zstandard.compress(content) if compress else content,
            message_start_time=min(times),
            message_end_time=max(times),
            uncompressed_crc=zlib.crc32(content),
            uncompressed_size=len(content),
        )
        self._add_chunk(chunk, to_bytes(chunk), index)

    def _named(self, channels: dict[int, list[int]]) -> bytes:
        """Channels of a chunk; their schemas, which are large, where they stand nowhere yet."""
        found = [self._channels[channel] for channel in channels]
        new = sorted({channel.schema_id for channel in found} - self._written_schemas - {0})
        self._written_schemas.update(new)
        return to_bytes(*(self._schemas[schema] for schema in new), *found)

    def copy_chunk(self, chunk: Chunk, raw: bytes, index: dict[int, list[int]]) -> None:
        """Write a chunk of another file as it is; ``index`` has (time, offset) of its messages."""
        self.end_chunk(compress=True)
        self._add_chunk(chunk, raw, index)

    def _add_chunk(self, chunk: Chunk, raw: bytes, index: dict[int, list[int]]) -> None:
        start = self._output.tell()
        self._write(raw)
        offsets, at = {}, start + len(raw)
        for channel, entries in index.items():
            offsets[channel] = at
            record = _message_index(channel, entries)
            self._write(record)
            at += len(record)
            self._counts[channel] = self._counts.get(channel, 0) + len(entries) // 2
        self._chunk_indexes.add(
            ChunkIndex(
                message_start_time=chunk.message_start_time,
                message_end_time=chunk.message_end_time,
                chunk_start_offset=start,
                chunk_length=len(raw),
                message_index_offsets=offsets,
                message_index_length=at - start - len(raw),
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                uncompressed_size=chunk.uncompressed_size,
            )
        )

    def copy(self, raw: bytes) -> None:
        """Write another record of the data section of another file as it is."""
        self.end_chunk(compress=True)
        self._write(raw)

    def add_metadata(self, name: str, data: dict[str, str]) -> None:
        """Write a metadata record."""
        self.end_chunk(compress=True)
        raw = to_bytes(Metadata(name=name, metadata=data))
        self._metadata_indexes.append(
            MetadataIndex(length=len(raw), name=name, offset=self._output.tell())
        )
        self._write(raw)

    def finish(self) -> None:
        """Write the end of the data, with its checksum, then the summary with its own."""
        self.end_chunk(compress=True)
        self._output.write(to_bytes(DataEnd(self._data_crc)))
        start = self._output.tell()
        groups: list[tuple[Opcode, bytes]] = [
            (Opcode.SCHEMA, to_bytes(*self._schemas.values())),
            (Opcode.CHANNEL, to_bytes(*self._channels.values())),
            (Opcode.STATISTICS, to_bytes(self._statistics())),
            (Opcode.CHUNK_INDEX, self._chunk_indexes.end()),
            (Opcode.METADATA_INDEX, to_bytes(*self._metadata_indexes)),
        ]
        summary, offsets = b"", []
        for opcode, data in groups:
            if data:
                offsets.append(
                    SummaryOffset(
                        group_length=len(data),
                        group_opcode=opcode,
                        group_start=start + len(summary),
                    )
                )
            summary += data
        offset_start = start + len(summary)
        summary += to_bytes(*offsets)
        begin = _FOOTER_BEGIN.pack(Opcode.FOOTER, _FOOTER_BYTES, start, offset_start)
        crc = zlib.crc32(begin, zlib.crc32(summary))
        footer = Footer(summary_start=start, summary_offset_start=offset_start, summary_crc=crc)
        self._output.write(summary + to_bytes(footer) + MCAP0_MAGIC)

    def _statistics(self) -> Statistics:
        chunks = self._chunk_indexes
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=chunks.number,
            message_count=sum(self._counts.values()),
            message_end_time=chunks.end_ns,
            message_start_time=chunks.start_ns,
            metadata_count=len(self._metadata_indexes),
            schema_count=len(self._schemas),
        )


def _moved(entries: list[int], by: int) -> list[int]:
    entries[1::2] = [offset + by for offset in entries[1::2]]
    return entries


def _message_index(channel: int, entries: list[int]) -> bytes:
    size = 8 * len(entries)
    head = _MESSAGE_INDEX.pack(Opcode.MESSAGE_INDEX, 6 + size, channel, size)
    return head + struct.pack(f"<{len(entries)}Q", *entries)

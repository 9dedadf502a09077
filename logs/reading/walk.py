"""The whole records of an MCAP file from its beginning to its end, and what is damaged between.

A chunk is taken when its checksum is right, and not otherwise. Behind damage the walk goes on at
the next chunk, wherever that is. What the file says of its own sizes is believed only within
bounds, so that no file makes its reader take more memory than a few chunks.
"""

import os
import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

from pneuarm.controllers.arm.errors import LogError

#: No record that is read is larger, packed or not; chunks of ours have 0.5 MiB at most.
MOST_BYTES = 8 * 1024 * 1024

_HEAD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQII")
_LENGTH = struct.Struct("<Q")
_CRC = struct.Struct("<I")
_MESSAGE = struct.Struct("<HIQQ")
_FOOTER = struct.Struct("<BQQQI")

#: Where the walk may go on: the head of a chunk, or the end of the data.
_RESUME = re.compile(
    rb"(?=\x06.{4}\0{4}.{20}\0{4}.{4}(?:\0{4}|\x03\0{3}lz4|\x04\0{3}zstd)|\x0f\x04\0{7})", re.DOTALL
)
_RESUME_BYTES = _HEAD.size + _CHUNK.size + 4
_SCAN_BYTES = 1024 * 1024

_RECORDS: dict[int, type[McapRecord]] = {
    Opcode.HEADER: Header,
    Opcode.FOOTER: Footer,
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.MESSAGE_INDEX: MessageIndex,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.ATTACHMENT: Attachment,
    Opcode.STATISTICS: Statistics,
    Opcode.METADATA: Metadata,
    Opcode.METADATA_INDEX: MetadataIndex,
    Opcode.SUMMARY_OFFSET: SummaryOffset,
    Opcode.DATA_END: DataEnd,
}


class Stored(NamedTuple):
    """A message as it stands in the file; ``channel`` is a number of the file's own."""

    channel: int
    sequence: int
    time_ns: int
    payload: bytes
    offset: int


@dataclass(frozen=True)
class GoodChunk:
    """A chunk with the right checksum: its channels, schemas and messages; ``raw`` is all of it."""

    offset: int
    raw: bytes
    chunk: Chunk
    named: list[McapRecord]
    messages: list[Stored]


@dataclass(frozen=True)
class GoodRecord:
    """A record outside of chunks: whole, but without a checksum of its own."""

    offset: int
    opcode: int
    raw: bytes
    record: "McapRecord | Stored"


@dataclass(frozen=True)
class Damage:
    """Bytes from ``begin`` to before ``end`` that are no whole record.

    ``cut`` says that they are the beginning of one, and then the file ends: as a crash leaves it.
    """

    path: Path
    begin: int
    end: int
    what: str = "unreadable"
    cut: bool = False

    def __str__(self) -> str:
        """Return where it is and how much."""
        size = self.end - self.begin
        where = f"{size} bytes at {self.begin} " if size else ""
        return f"{self.path.name}: {where}{self.what}"


Piece = GoodChunk | GoodRecord | Damage


class _File:
    """Bytes of a file at any place; fewer, or none, past its end."""

    def __init__(self, path: Path) -> None:
        try:
            # Not blocking: a pipe by this name must not hold us.
            self._fd = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        except OSError as error:
            raise LogError(f"{path} cannot be read: {error.strerror}") from error
        self.size = os.fstat(self._fd).st_size

    def read(self, offset: int, size: int) -> bytes:
        return os.pread(self._fd, max(0, min(size, self.size - offset)), offset)

    def __enter__(self) -> "_File":
        return self

    def __exit__(self, *error: object) -> None:
        os.close(self._fd)


def walk(path: Path) -> Iterator[Piece]:
    """Yield what is whole, and what is damaged, in the order of the file; every byte of it once.

    Raises LogError where the file cannot be opened or read.
    """
    try:
        with _File(path) as file:
            yield from _Walk(path, file).pieces()
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror}") from error


def data_is_right(path: Path) -> bool:
    """Say whether a closed file has a checksum over all its data, and that is right."""
    has_checksum = False
    for piece in walk(path):
        if isinstance(piece, Damage):
            return False
        if isinstance(piece, GoodRecord) and isinstance(piece.record, DataEnd):
            has_checksum = piece.record.data_section_crc != 0
    return has_checksum


class _Walk:
    def __init__(self, path: Path, file: _File) -> None:
        self._path, self._file = path, file
        self._crc = zlib.crc32(MCAP0_MAGIC)
        self._whole = True  # so far, so that the data's checksum can be compared
        self._checked = 0  # before it no chunk is left: what came since may be no record at all

    def pieces(self) -> Iterator[Piece]:
        begins_well = self._file.read(0, len(MCAP0_MAGIC)) == MCAP0_MAGIC
        at = len(MCAP0_MAGIC) if begins_well else 0
        while at < self._file.size and not self._is_end(at):
            piece = self._piece(at)
            if piece is None:
                resumed = self._resume(at)
                begin = min(at, resumed)
                yield Damage(self._path, begin, resumed, cut=self._is_cut(begin, resumed))
                # No chunk begins before it: what was tried once is not tried again.
                self._whole, self._checked, at = False, resumed, resumed
            else:
                yield piece
                yield from self._check_data(piece)
                at += len(piece.raw)
                if isinstance(piece, GoodChunk):
                    self._checked = at

    def _is_end(self, at: int) -> bool:
        tail = self._file.size - at
        return tail == len(MCAP0_MAGIC) and self._file.read(at, tail) == MCAP0_MAGIC

    def _check_data(self, piece: GoodChunk | GoodRecord) -> Iterator[Damage]:
        """Compare the checksum of all data where it ends: it covers what is outside of chunks."""
        if isinstance(piece, GoodRecord) and isinstance(piece.record, DataEnd):
            expected = piece.record.data_section_crc
            if self._whole and expected not in (0, self._crc):
                what = "changed outside of the chunks; no message of a chunk is concerned"
                yield Damage(self._path, piece.offset, piece.offset, what)
        self._crc = zlib.crc32(piece.raw, self._crc)

    def _piece(self, at: int) -> GoodChunk | GoodRecord | None:
        """Return the record that begins here, or None where none that is whole does."""
        head = self._file.read(at, _HEAD.size)
        if len(head) < _HEAD.size:
            return None
        opcode, length = _HEAD.unpack(head)
        if length > MOST_BYTES or at + _HEAD.size + length > self._file.size:
            return None
        raw = self._file.read(at, _HEAD.size + length)
        if len(raw) < _HEAD.size + length:
            return None
        if opcode == Opcode.CHUNK:
            return _good_chunk(at, raw)
        record = self._record(opcode, at, raw)
        return None if record is None else GoodRecord(at, opcode, raw, record)

    def _record(self, opcode: int, at: int, raw: bytes) -> "McapRecord | Stored | None":
        if opcode == Opcode.MESSAGE:
            # Its length is all that frames it: something must follow that could be a record.
            after = self._file.read(at + len(raw), 1)
            plausible = not after or 0 < after[0] <= Opcode.DATA_END
            return _message(raw, 0, len(raw), at) if plausible else None
        return _parsed(opcode, raw)

    def _resume(self, damaged: int) -> int:
        """Return where the next chunk or the end of the data begins, or the end of the file.

        A chunk may also begin before the damage, inside of what passed for a record.
        """
        at = self._checked
        while at < self._file.size:
            window = self._file.read(at, _SCAN_BYTES + _RESUME_BYTES)
            for match in _RESUME.finditer(window):
                piece = self._piece(at + match.start())
                if isinstance(piece, GoodChunk) or (piece is not None and piece.offset > damaged):
                    return piece.offset
            at += _SCAN_BYTES
        return self._file.size

    def _is_cut(self, begin: int, end: int) -> bool:
        """Say whether these bytes are the beginning of a record, cut off by the end of the file."""
        closing = self._file.read(max(0, self._file.size - len(MCAP0_MAGIC)), len(MCAP0_MAGIC))
        if end != self._file.size or closing == MCAP0_MAGIC:
            return False
        head = self._file.read(begin, _RESUME_BYTES + 4 + _LENGTH.size)
        if len(head) < _HEAD.size:
            return bool(head.strip(b"\0"))
        opcode, length = _HEAD.unpack_from(head)
        too_short = begin + _HEAD.size + length > end and length <= MOST_BYTES
        if opcode != Opcode.CHUNK or len(head) < _RESUME_BYTES + 4 + _LENGTH.size:
            return too_short and opcode in (*_RECORDS, Opcode.CHUNK, Opcode.MESSAGE)
        return too_short and _frame(head, _HEAD.size + length) is not None


def _frame(raw: bytes, size: int) -> "tuple[int, int, str, int] | None":
    """Return uncompressed size, checksum, compression and where the data begins.

    None where the sizes in the head of a chunk, whose record has ``size`` bytes, contradict.
    """
    try:
        _, _, uncompressed, crc, name_bytes = _CHUNK.unpack_from(raw, _HEAD.size)
        begin = _HEAD.size + _CHUNK.size + name_bytes
        name = raw[begin - name_bytes : begin].decode("ascii")
        (data_bytes,) = _LENGTH.unpack_from(raw, begin)
    except (struct.error, UnicodeDecodeError):
        return None
    begin += _LENGTH.size
    if begin + data_bytes != size or uncompressed > MOST_BYTES:
        return None
    return uncompressed, crc, name, begin


def _good_chunk(at: int, raw: bytes) -> GoodChunk | None:
    frame = _frame(raw, len(raw))
    if frame is None:
        return None
    size, crc, compression, begin = frame
    try:
        content = _unpacked(compression, raw[begin:], size)
    except (zstandard.ZstdError, RuntimeError, EOFError):
        return None
    # A checksum of 0 would mean "none" to MCAP: no chunk of ours is without, zeroed ones are.
    if len(content) != size or zlib.crc32(content) != crc:
        return None
    start_ns, end_ns = struct.unpack_from("<QQ", raw, _HEAD.size)
    chunk = Chunk(
        compression=compression,
        data=raw[begin:],
        message_start_time=start_ns,
        message_end_time=end_ns,
        uncompressed_crc=crc,
        uncompressed_size=size,
    )
    return _opened(at, raw, chunk, content)


def _unpacked(compression: str, data: bytes, size: int) -> bytes:
    """Decompress up to a byte more than ``size``, whatever the data promises."""
    if compression == "zstd":
        reader = zstandard.ZstdDecompressor(max_window_size=MOST_BYTES).stream_reader(data)
        return bytes(reader.read(size + 1))
    if compression == "lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1))
    return data if not compression else b""


def _opened(at: int, raw: bytes, chunk: Chunk, content: bytes) -> GoodChunk | None:
    named: list[McapRecord] = []
    messages: list[Stored] = []
    position = 0
    while position < len(content):
        if position + _HEAD.size > len(content):
            return None
        opcode, length = _HEAD.unpack_from(content, position)
        end = position + _HEAD.size + length
        if end > len(content):
            return None
        if opcode == Opcode.MESSAGE:
            message = _message(content, position, end, position)
            if message is None:
                return None
            messages.append(message)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            record = _parsed(opcode, content[position:end])
            if record is None:
                return None
            named.append(record)
        position = end
    return GoodChunk(at, raw, chunk, named, messages)


def _message(data: bytes, begin: int, end: int, offset: int) -> Stored | None:
    body = begin + _HEAD.size
    if end - body < _MESSAGE.size:
        return None
    channel, sequence, time_ns, _ = _MESSAGE.unpack_from(data, body)
    return Stored(channel, sequence, time_ns, data[body + _MESSAGE.size : end], offset)


def _parsed(opcode: int, raw: bytes) -> McapRecord | None:
    """Return a record of a kind that the library knows, None where its parts contradict."""
    kind = _RECORDS.get(opcode)
    if kind is None:
        return None
    stream = ReadDataStream(BytesIO(raw[_HEAD.size :]))
    try:
        record: McapRecord = kind.read(stream)  # type: ignore[attr-defined]
    except Exception:  # damaged bytes: there is nothing that the library does not raise
        return None
    if stream.count != len(raw) - _HEAD.size:
        return None
    if opcode == Opcode.ATTACHMENT and _CRC.unpack(raw[-4:])[0] != zlib.crc32(raw[9:-4]):
        return None
    return record


@dataclass(frozen=True)
class Summary:
    """What the end of a closed file says of all of it; its checksum was right."""

    channels: dict[int, Channel]
    schemas: dict[int, Schema]
    counts: dict[int, int]
    chunks: list[ChunkIndex]


def read_summary(path: Path) -> Summary | None:
    """Return the summary of a file that was closed and whose end is whole, else None."""
    try:
        with _File(path) as file:
            return _summary(file)
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror}") from error


def _summary(file: _File) -> Summary | None:
    end = file.size - _FOOTER.size - len(MCAP0_MAGIC)
    tail = file.read(max(0, end), _FOOTER.size + len(MCAP0_MAGIC))
    if end < 0 or not tail.endswith(MCAP0_MAGIC):
        return None
    opcode, length, start, _, crc = _FOOTER.unpack_from(tail)
    if (opcode, length) != (Opcode.FOOTER, 20) or not 0 < start <= end:
        return None
    found = Summary({}, {}, {}, [])
    at, running = start, 0
    while at < end:
        head = file.read(at, _HEAD.size)
        if len(head) < _HEAD.size:
            return None
        opcode, length = _HEAD.unpack(head)
        if length > MOST_BYTES or at + _HEAD.size + length > end:
            return None
        raw = file.read(at, _HEAD.size + length)
        running, at = zlib.crc32(raw, running), at + len(raw)
        _take(found, _parsed(opcode, raw))
    return found if zlib.crc32(tail[:25], running) == crc else None


def _take(found: Summary, record: McapRecord | None) -> None:
    match record:
        case Channel():
            found.channels[record.id] = record
        case Schema():
            found.schemas[record.id] = record
        case Statistics():
            found.counts.update(record.channel_message_counts)
        case ChunkIndex():
            found.chunks.append(record)

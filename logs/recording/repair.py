"""Mending what a crash has left: everything that is whole goes into a new file, as it is.

The new file takes the place of the old one only when it is on the disk and holds as much. Unless it
begins with every byte of the old one but a cut end, that is kept beside it. No symbolic link is
followed.
"""

import contextlib
import fcntl
import os
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Metadata, Schema

from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.reading.parts import is_plain_file, topic_of
from pneuarm.logs.reading.walk import (
    Damage,
    GoodChunk,
    GoodRecord,
    Stored,
    Summary,
    read_summary,
    walk,
)
from pneuarm.logs.recording.chunked_file import ChunkedFile, to_bytes
from pneuarm.logs.recording.part import schema_of

#: Of the file that was mended, where it is kept, and of one that holds nothing.
KEPT = ".broken"
_TEMPORARY = ".repairing"

_COMPARED_BYTES = 1024 * 1024

#: What the new file has of its own.
_MADE_ANEW = {
    Opcode.HEADER,
    Opcode.FOOTER,
    Opcode.MESSAGE_INDEX,
    Opcode.CHUNK_INDEX,
    Opcode.STATISTICS,
    Opcode.METADATA_INDEX,
    Opcode.ATTACHMENT_INDEX,
    Opcode.SUMMARY_OFFSET,
    Opcode.DATA_END,
}


@dataclass(frozen=True)
class Mended:
    """What became of a broken file; ``messages`` is 0, and ``path`` None, where it held nothing.

    ``kept`` is where the original is, None where nothing was dropped but a cut end.
    """

    path: Path | None
    messages: int
    dropped_bytes: int = 0
    kept: Path | None = None


def repair(path: Path) -> Mended:
    """Replace a broken file by one with everything that can be read.

    Raises LogError where there is no room, or somebody else holds the file; it is as it was then.
    """
    if not is_plain_file(path):
        raise LogError(f"{path} is a link, or no file: it is left as it is; name the file itself")
    try:
        with _locked(path):
            return _repair(path)
    except OSError as error:
        raise LogError(
            f"{path} cannot be repaired: {error}; free some space and start again"
        ) from error


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold the file, so that nobody writes to it or mends it meanwhile; raises LogError if not."""
    file = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise LogError(f"{path} is in use: it is left as it is") from error
        yield
    finally:
        os.close(file)


def _repair(path: Path) -> Mended:
    temporary = path.with_name(path.name + _TEMPORARY)
    try:
        dropped = _write_anew(path, temporary)
        held, holds = _messages_of(path), _messages_of(temporary)
        if held != holds:
            raise LogError(f"{path} cannot be repaired without losing messages: it is as it was")
        if not held:
            temporary.unlink()
            return Mended(None, 0, kept=_keep(path, move=True))
        kept = None if _goes_on(temporary, path, dropped) else _keep(path, move=False)
        temporary.replace(path)
        _sync_folder(path.parent)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    lost_bytes = sum(damage.end - damage.begin for damage in dropped)
    return Mended(path, sum(held.values()), lost_bytes, kept)


def _write_anew(source: Path, destination: Path) -> list[Damage]:
    """Copy everything whole; return what is not."""
    destination.unlink(missing_ok=True)  # of an attempt that was killed; a link goes, not its end
    mode = source.stat().st_mode & 0o777
    descriptor = os.open(destination, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode)
    with os.fdopen(descriptor, "wb") as file:
        dropped = _copy(source, ChunkedFile(file))
        file.flush()
        os.fsync(file.fileno())
    return dropped


def _copy(source: Path, mended: ChunkedFile) -> list[Damage]:
    dropped: list[Damage] = []
    summary = read_summary(source)
    names = _Names(mended, summary)
    in_data = True
    for piece in walk(source):
        match piece:
            case Damage():
                dropped.append(piece)
            case GoodChunk():
                names.bring(piece)
                mended.copy_chunk(*_with_its_times(piece), _index(piece))
            case GoodRecord(opcode=Opcode.DATA_END):
                in_data = False
            case GoodRecord() if in_data and piece.opcode not in _MADE_ANEW:
                if isinstance(piece.record, Schema | Channel):
                    names.write(piece.record)
                elif isinstance(piece.record, Metadata):
                    mended.add_metadata(piece.record.name, piece.record.metadata)
                else:
                    mended.copy(piece.raw)
    mended.finish()
    return dropped


class _Names:
    """Sees to it that every channel and schema stands before the first chunk that needs it."""

    def __init__(self, mended: ChunkedFile, summary: Summary | None) -> None:
        self._mended, self._told = mended, summary or Summary({}, {}, {}, [])
        self._channels: set[int] = set()
        self._schemas: set[int] = set()

    def write(self, record: Schema | Channel) -> None:
        """Write one that stands outside of chunks, unless it is there already."""
        known = self._schemas if isinstance(record, Schema) else self._channels
        if record.id not in known:
            known.add(record.id)
            self._mended.register(record)
            self._mended.copy(to_bytes(record))

    def bring(self, chunk: GoodChunk) -> None:
        """Write what a chunk needs and does not have, since the chunk that had it is lost."""
        own = [record for record in chunk.named if isinstance(record, Schema | Channel)]
        schemas = {record.id for record in own if isinstance(record, Schema)}
        channels = {record.id: record for record in own if isinstance(record, Channel)}
        for number in {message.channel for message in chunk.messages} - channels.keys():
            if number in self._told.channels:
                channels[number] = self._told.channels[number]
        for channel in channels.values():
            if channel.schema_id not in schemas and (schema := self._schema(channel)):
                self.write(schema)
        for channel in channels.values():
            if channel not in own:
                self.write(channel)
        self._schemas |= schemas
        self._channels |= channels.keys()
        self._mended.register(*own)

    def _schema(self, channel: Channel) -> Schema | None:
        """Return the schema of the file, or ours for a message of ours."""
        topic = topic_of(channel)
        if channel.schema_id in self._told.schemas:
            return self._told.schemas[channel.schema_id]
        return schema_of(topic, channel.schema_id) if topic is not None else None


def _with_its_times(piece: GoodChunk) -> tuple[Chunk, bytes]:
    """Return a chunk with the times of its messages, which no checksum covers in its head."""
    times = [message.time_ns for message in piece.messages] or [0]
    chunk = replace(piece.chunk, message_start_time=min(times), message_end_time=max(times))
    return chunk, piece.raw if chunk == piece.chunk else to_bytes(chunk)


def _index(chunk: GoodChunk) -> dict[int, list[int]]:
    index: dict[int, list[int]] = {}
    for message in chunk.messages:
        index.setdefault(message.channel, []).extend((message.time_ns, message.offset))
    return index


def _messages_of(path: Path) -> "Counter[int]":
    """Count the messages a channel that can be read."""
    counts: Counter[int] = Counter()
    for piece in walk(path):
        if isinstance(piece, GoodChunk):
            counts.update(message.channel for message in piece.messages)
        elif isinstance(piece, GoodRecord) and isinstance(piece.record, Stored):
            counts[piece.record.channel] += 1
    return counts


def _goes_on(mended: Path, path: Path, dropped: list[Damage]) -> bool:
    """Say whether the new file begins with all of the old one but its cut end, byte for byte."""
    left = next((damage.begin for damage in dropped if damage.cut), path.stat().st_size)
    with mended.open("rb") as new, path.open("rb") as old:
        while left > 0:
            size = min(left, _COMPARED_BYTES)
            if new.read(size) != old.read(size):
                return False
            left -= size
    return True


def _keep(path: Path, move: bool) -> Path:
    """Give the original another name, one that is free; with ``move`` it loses its own."""
    number = 1
    while True:
        kept = path.with_name(path.name + KEPT + (f".{number}" if number > 1 else ""))
        if not os.path.lexists(kept):
            break
        number += 1
    try:
        os.link(path, kept, follow_symlinks=False)
    except OSError:  # no such links on this file system
        path.rename(kept)
        return kept
    if move:
        path.unlink()
    return kept


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)

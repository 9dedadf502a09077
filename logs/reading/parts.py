"""Which files are one session: by what is in them, whatever they are called.

Every channel of ours carries the session and the number of the part; in logs from before that, the
facts with which a part begins name the first file of the session.
"""

import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from google.protobuf.message import DecodeError
from mcap.records import Channel
from mcap.well_known import MessageEncoding

from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.reading.walk import GoodChunk, GoodRecord, Stored, read_summary, walk
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import INFO, LOGGED, Topic, split_key

#: Of a channel's own metadata.
SESSION, PART = "session", "part"

_BY_KEY = {topic.key: topic for topic in LOGGED}


def topic_of(channel: object) -> Topic | None:
    """Return our topic of a channel, None for a channel of somebody else."""
    if not isinstance(channel, Channel) or channel.message_encoding != MessageEncoding.Protobuf:
        return None
    return _BY_KEY.get(split_key(channel.topic)[1])


@dataclass(frozen=True)
class Identity:
    """Of which session a file is a part, which part, and when that begins."""

    session: str
    part: int | None
    begin_ns: int


def identity(path: Path) -> Identity | None:
    """Say what a file is by its first good chunk; None for what is not ours, or nothing at all."""
    for piece in walk(path):
        if isinstance(piece, GoodChunk):
            return _identity(path, piece)
        if isinstance(piece, GoodRecord):
            if topic_of(piece.record) is not None:  # of a file that was written without chunks
                return Identity(path.stem, None, 0)
            if isinstance(piece.record, Stored):  # of somebody else, and maybe very long
                return None
    return None


def _identity(path: Path, chunk: GoodChunk) -> Identity | None:
    channels = [record for record in chunk.named if isinstance(record, Channel)]
    if not channels and (summary := read_summary(path)) is not None:
        channels = list(summary.channels.values())
    ours = {channel.id: channel for channel in channels if topic_of(channel) is not None}
    if not ours:
        return None
    begin_ns = min((message.time_ns for message in chunk.messages), default=0)
    for channel in ours.values():
        if SESSION in channel.metadata:
            number = channel.metadata.get(PART, "")
            part = int(number) if number.isdecimal() else None
            return Identity(channel.metadata[SESSION], part, begin_ns)
    return Identity(_named_by_facts(chunk, ours) or path.stem, None, begin_ns)


def _named_by_facts(chunk: GoodChunk, channels: dict[int, Channel]) -> str:
    for message in chunk.messages:
        if message.channel in channels and topic_of(channels[message.channel]) is INFO:
            try:
                return Path(pb.Info.FromString(message.payload).log_path).stem
            except DecodeError:
                return ""
    return ""


def is_plain_file(path: Path) -> bool:
    """Say whether this is a file itself, no link to one, no pipe."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:
        return False


def parts_of(path: Path) -> list[Path]:
    """Return all parts of the session that begins with ``path``; only itself for a later part."""
    own = identity(path)
    if own is None:
        return [path]
    found = {_key(own, path): (own, path)}
    for other, other_path in _others(path):
        if other.session == own.session:
            found.setdefault(_key(other, other_path), (other, other_path))  # a copy counts once
    ordered = sorted(found.values(), key=lambda part: (part[0].part or 0, part[0].begin_ns))
    paths = [each for _, each in ordered]
    return paths if paths[0] == path else [path]


def _key(own: Identity, path: Path) -> object:
    return path.name if own.part is None else own.part


def _others(path: Path) -> Iterator[tuple[Identity, Path]]:
    for other in sorted(path.absolute().parent.glob("*.mcap")):
        if other.name == path.name or not is_plain_file(other):
            continue
        try:
            found = identity(other)
        except LogError:
            continue  # not ours to read
        if found is not None:
            yield found, path.parent / other.name

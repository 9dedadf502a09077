"""Session files: where they lie, how they are named, which belong together, which are unfinished.

A session is one or more parts: ``20261122T123543Z-paper.mcap``, ``...-paper.001.mcap`` and so on.
The recorder holds a lock on the part it writes; a part without MCAP's closing bytes that nobody
holds is what a crash has left.
"""

import fcntl
import os
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

from mcap.records import Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC, Writer

from pneuarm.controllers.arm.errors import LogError

#: What session_name() makes; other people's files in the directory are left alone.
_OURS = "[0-9]*T[0-9]*Z-*.mcap"


def session_name(start_unix_ns: int, arm_name: str) -> str:
    """Name of a session: UTC time of its start, and the arm."""
    start = datetime.fromtimestamp(start_unix_ns / 1e9, UTC)
    return f"{start:%Y%m%dT%H%M%SZ}-{arm_name}"


def part_path(directory: Path, name: str, part: int) -> Path:
    """Path of a part; the first has no number."""
    return directory / (f"{name}.mcap" if part == 0 else f"{name}.{part:03d}.mcap")


def parts_of(path: Path) -> list[Path]:
    """All parts of the session that starts with ``path``; only itself for a later part."""
    rest = sorted(path.parent.glob(f"{path.stem}.[0-9][0-9][0-9].mcap"))
    return [path, *rest]


def is_finished(path: Path) -> bool:
    """Say whether the file ends as an MCAP file does."""
    with path.open("rb") as file:
        if file.seek(0, os.SEEK_END) < 2 * len(MCAP0_MAGIC):
            return False
        file.seek(-len(MCAP0_MAGIC), os.SEEK_END)
        return file.read() == MCAP0_MAGIC


def unfinished(directory: Path) -> list[Path]:
    """Return parts that a crash has left: not finished, and no recorder holds them."""
    return [
        path
        for path in sorted(directory.glob(_OURS))
        if not is_finished(path) and not _is_locked(path)
    ]


def _is_locked(path: Path) -> bool:
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return True
    return False


def whole_records(path: Path) -> Iterable[object]:
    """MCAP records up to the end of the file, or up to where it breaks off."""
    with path.open("rb") as file:
        records = iter(StreamReader(file, validate_crcs=False).records)
        while True:
            try:
                yield next(records)
            except StopIteration:
                return
            except Exception:  # broken off or damaged; there is nothing the library does not raise
                return


def repair(path: Path) -> tuple[Path, int]:
    """Rewrite a broken file with everything that can be read; return its path and message count.

    A file without a single whole record is set aside under the name ``....broken`` instead. The
    original is replaced only when the new one is complete.
    """
    temporary = path.with_suffix(".repairing")
    try:
        messages = _copy_records(path, temporary)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise LogError(
            f"{path} cannot be repaired: {error}; free some space and start again"
        ) from error
    if messages == 0:
        temporary.unlink()
        return path.rename(path.with_suffix(".mcap.broken")), 0
    temporary.replace(path)
    return path, messages


def _copy_records(source: Path, destination: Path) -> int:
    """Copy schemas, channels, messages and metadata; return the number of messages."""
    count = 0
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    with destination.open("wb") as file:
        writer = Writer(file)
        writer.start()
        for record in whole_records(source):
            match record:
                case Schema() if record.id not in schemas:
                    schemas[record.id] = writer.register_schema(
                        record.name, record.encoding, record.data
                    )
                case Channel() if record.id not in channels:
                    channels[record.id] = writer.register_channel(
                        record.topic, record.message_encoding, schemas.get(record.schema_id, 0)
                    )
                case Message() if record.channel_id in channels:
                    writer.add_message(
                        channels[record.channel_id],
                        record.log_time,
                        record.data,
                        record.publish_time,
                        record.sequence,
                    )
                    count += 1
                case Metadata():
                    writer.add_metadata(record.name, record.metadata)
        writer.finish()
        file.flush()
        os.fsync(file.fileno())
    return count


def _age(path: Path) -> tuple[str, str]:
    """Sort key, oldest first: session, then part; by the bare name the first part sorts last."""
    session, _, part = path.stem.partition(".")
    return session, part


def delete_oldest(directory: Path, keep_bytes: int) -> list[Path]:
    """Delete the oldest finished parts until the rest fits ``keep_bytes``; 0 keeps everything."""
    if keep_bytes <= 0:
        return []
    files = sorted(directory.glob(_OURS), key=_age, reverse=True)
    total, deleted = 0, []
    for path in files:
        total += path.stat().st_size
        if total > keep_bytes and is_finished(path):
            path.unlink()
            deleted.append(path)
    return deleted

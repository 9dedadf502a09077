"""Session files: how they are named, which are unfinished, and which go when room is wanted.

A session is one or more parts: ``20261122T123543Z-paper.mcap``, ``...-paper.001.mcap`` and so on.
The recorder holds a lock on the part it writes; a part without MCAP's closing bytes that nobody
holds is what a crash has left. Only what has a name and a content of ours is ever touched.
"""

import contextlib
import fcntl
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.reading.parts import Identity, identity, is_plain_file
from pneuarm.logs.reading.walk import GoodChunk, GoodRecord, Piece, read_summary, walk

#: What session_name() makes; other people's files in the directory are left alone.
_OURS = "[0-9]*T[0-9]*Z-*.mcap"

#: An empty file younger than this (s) may be a recorder's that has not yet locked it.
_YOUNG_S = 60.0


def session_name(start_unix_ns: int, arm_name: str) -> str:
    """Name of a session: UTC time of its start, and the arm."""
    start = datetime.fromtimestamp(start_unix_ns / 1e9, UTC)
    return f"{start:%Y%m%dT%H%M%SZ}-{arm_name}"


def part_path(directory: Path, name: str, part: int) -> Path:
    """Path of a part; the first has no number."""
    return directory / (f"{name}.mcap" if part == 0 else f"{name}.{part:03d}.mcap")


def is_finished(path: Path) -> bool:
    """Say whether the file ends as an MCAP file does, and its end is whole."""
    return read_summary(path) is not None


def _named_like_ours(directory: Path) -> Iterator[Path]:
    yield from (path for path in sorted(directory.glob(_OURS)) if is_plain_file(path))


def unfinished(directory: Path) -> list[Path]:
    """Return parts that a crash has left: ours, not finished, and no recorder holds them."""
    found = []
    for path in _named_like_ours(directory):
        with contextlib.suppress(LogError, OSError):  # gone, or not for us to read
            if not is_finished(path) and _is_ours_or_nothing(path) and not _is_locked(path):
                found.append(path)
    return found


def _is_ours_or_nothing(path: Path) -> bool:
    """Say whether a file is a session's, or the beginning of one that holds nothing yet."""
    if identity(path) is not None:
        return True
    status = path.stat()
    if status.st_size == 0:
        return time.time() - status.st_mtime > _YOUNG_S
    with path.open("rb") as file:
        head = file.read(len(MCAP0_MAGIC))
    return head == MCAP0_MAGIC[: len(head)] and not any(map(_holds_something, walk(path)))


def _holds_something(piece: Piece) -> bool:
    if isinstance(piece, GoodRecord):
        return piece.opcode in (Opcode.MESSAGE, Opcode.ATTACHMENT)
    return isinstance(piece, GoodChunk)


def _is_locked(path: Path) -> bool:
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return True
    return False


def delete_oldest(directory: Path, keep_bytes: int) -> list[Path]:
    """Delete the oldest finished parts until the rest fits ``keep_bytes``; 0 keeps everything.

    What is no session of pneuarm, by its name or by its content, is neither counted nor deleted.
    """
    if keep_bytes <= 0:
        return []
    total, deleted = 0, []
    for _, path, size in sorted(_ours(directory), reverse=True):
        total += size
        if total > keep_bytes and is_finished(path) and not _is_locked(path):
            path.unlink(missing_ok=True)
            deleted.append(path)
    return deleted


def _ours(directory: Path) -> "Iterator[tuple[tuple[int, int], Path, int]]":
    """Yield age, path and size of every part; the lower age is the older."""
    for path in _named_like_ours(directory):
        with contextlib.suppress(LogError, OSError):  # gone meanwhile, or not for us to read
            found = identity(path)
            if found is not None:
                yield _age(found), path, path.stat().st_size


def _age(found: Identity) -> tuple[int, int]:
    return found.begin_ns, found.part or 0

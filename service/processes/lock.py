"""The lock on a device and on an arm's name: one daemon each on this machine.

A lock of the kernel's on an open file: it goes with the last process that has the file, however
that ends, and it holds across network namespaces and users. The file is never deleted, since a
name that may go can be locked twice; it is empty but for who holds it, and lies in memory.
"""

import contextlib
import fcntl
import os
from hashlib import sha256
from io import FileIO
from multiprocessing.reduction import DupFd
from pathlib import Path
from typing import Any

from pneuarm.controllers.arm.errors import AlreadyInUse, ConfigurationError

#: The first of these that is there; what every user may write to and no service has for itself.
_PLACES = (Path("/dev/shm"), Path("/run/lock"), Path("/tmp"))

_ANYBODY = 0o666


class Lock:
    """A lock that is held; handed to a child process, it is held there too."""

    def __init__(self, descriptor: int) -> None:
        self._file = FileIO(descriptor, "r+")

    def fileno(self) -> int:
        """Return the descriptor of the file."""
        return self._file.fileno()

    def close(self) -> None:
        """Give it back, where no other process has it."""
        self._file.close()

    def __enter__(self) -> "Lock":
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Give it back."""
        self.close()

    def __reduce__(self) -> Any:
        """Travel to a child process as a descriptor of the same open file."""
        return _arrived, (DupFd(self.fileno()),)


def _arrived(descriptor: Any) -> Lock:
    return Lock(descriptor.detach())


def lock(kind: str, name: str) -> Lock:
    """Take the lock on a device or an arm; raises AlreadyInUse if another daemon has it."""
    path = _path(kind, name)
    try:
        descriptor = _open(path)
    except OSError as error:
        raise ConfigurationError(
            f"{kind} {name!r} cannot be locked: {path}: {error.strerror}; without that lock two "
            "daemons could move one arm"
        ) from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        process_id = _holder(descriptor)
        os.close(descriptor)
        who = f" (process {process_id})" if process_id is not None else ""
        raise AlreadyInUse(
            f"{kind} {name!r} is in use by another pneuarm daemon{who}; stop that one first, or "
            f"name another {kind}",
            process_id,
        ) from error
    with contextlib.suppress(OSError):  # a full disk: then nobody learns who it is
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, str(os.getpid()).encode(), 0)
    return Lock(descriptor)


def _path(kind: str, name: str) -> Path:
    place = next((place for place in _PLACES if place.is_dir()), _PLACES[-1])
    return (
        place / f"pneuarm-{kind}-{sha256(name.encode(errors='surrogateescape')).hexdigest()[:24]}"
    )


def _open(path: Path) -> int:
    """Open the file of a lock, which anybody may have made.

    Where it is another user's the kernel refuses it to who would create it if need be, so that it
    is created, and opened, by two calls.
    """
    flags = os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK
    with contextlib.suppress(FileNotFoundError):
        return os.open(path, flags)
    with contextlib.suppress(FileExistsError):  # made by another daemon in between
        descriptor = os.open(path, flags | os.O_CREAT | os.O_EXCL, _ANYBODY)
        os.fchmod(descriptor, _ANYBODY)  # whatever the umask is
        return descriptor
    return os.open(path, flags)


def _holder(descriptor: int) -> int | None:
    """Process number of who took a lock, as it says itself."""
    told = os.pread(descriptor, 16, 0)
    return int(told) if told.isdigit() else None

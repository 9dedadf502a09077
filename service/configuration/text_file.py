"""A text file that a person has named: read whole, and never waited for."""

import os
import stat
from pathlib import Path

from pneuarm.controllers.arm.errors import InvalidInput

_MOST_BYTES = 4 * 1024 * 1024


def read_text(path: Path) -> str:
    """Return a UTF-8 text, without the mark that some editors put before it.

    Raises InvalidInput for what is no file, cannot be read, or is no text.
    """
    try:
        content = _content(path)
    except (OSError, ValueError) as error:  # a NUL in a path is a ValueError
        raise InvalidInput(f"{path} cannot be read: {_why(error)}") from error
    if len(content) > _MOST_BYTES:
        raise InvalidInput(f"{path} cannot be read: it is longer than {_MOST_BYTES} bytes")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput(
            f"{path} is no text in UTF-8 (byte {error.start}): save it as UTF-8"
        ) from error


def _content(path: Path) -> bytes:
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    with open(descriptor, "rb") as file:  # which refuses a folder
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise ValueError("it is a pipe or a device, and a file is needed")
        return file.read(_MOST_BYTES + 1)


def _why(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)

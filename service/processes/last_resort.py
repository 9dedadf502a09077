"""What somebody in front of a terminal is told of any exception: one sentence, never a traceback.

Loads nothing that could fail where memory or files have run out.
"""

import errno
import os
import tempfile
import traceback
from pathlib import Path

from pneuarm.controllers.arm.errors import ConfigurationError, PneuarmError

#: What this machine has run out of, and what helps.
_REMEDIES = {
    errno.EMFILE: "let it open more files: ulimit -n 4096",
    errno.ENFILE: "end other programs: this machine has no more files to open",
    errno.ENOSPC: "free some space",
    errno.EDQUOT: "free some space",
    errno.EROFS: "name a folder on a disk that can be written to",
    errno.ENOMEM: "free some memory, or raise ulimit -v",
    errno.EIO: "a disk or a device fails: see dmesg",
    errno.EAGAIN: "end other programs, or raise ulimit -u",
    errno.EACCES: "see who may read and write there",
    errno.EPERM: "see who may read and write there",
}

_LONGEST_WORD = 400


def sentence(error: BaseException) -> str:
    """Return one sentence for any exception; a traceback goes to a file, which it names."""
    if isinstance(error, ConfigurationError):  # a line a mistake
        return "\n".join(map(_shown, str(error).split("\n")))
    if isinstance(error, PneuarmError):
        return _shown(str(error))
    if isinstance(error, MemoryError):
        return f"this machine has no memory left for it; {_REMEDIES[errno.ENOMEM]}"
    if isinstance(error, OSError) and (error.errno in _REMEDIES or error.filename is not None):
        where = f"{error.filename}: " if error.filename is not None else ""
        remedy = _REMEDIES.get(error.errno or 0, "")
        return _shown(f"{where}{error.strerror}{'; ' if remedy else ''}{remedy}")
    what = _shown(" ".join(f"{type(error).__name__}: {error}".split()))
    return f"{what}; this is a bug of pneuarm's own: please report it with {_kept(error)}"


def _shown(text: str) -> str:
    """Escape what would break the line or the terminal; cut what nobody reads to its end."""
    escaped = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    return " ".join(
        word if len(word) <= _LONGEST_WORD else f"{word[:60]}...({len(word)} characters)"
        for word in escaped.split(" ")
    )


def _kept(error: BaseException) -> str:
    """Write the traceback to the user's state, or where there is room; say where it is."""
    lines = "".join(traceback.format_exception(error))
    for find in (_state_folder, lambda: Path(tempfile.gettempdir())):
        try:
            folder = find()
            descriptor, name = tempfile.mkstemp(".txt", "pneuarm-error-", folder)
            with os.fdopen(descriptor, "w", errors="backslashreplace") as file:
                file.write(lines)
        except Exception:
            continue
        return name
    return "what was done before (its traceback could be written nowhere)"


def _state_folder() -> Path:
    from platformdirs import user_state_path

    folder = user_state_path("pneuarm") / "errors"
    if not folder.is_absolute():  # a user without a home
        raise FileNotFoundError(folder)
    folder.mkdir(parents=True, exist_ok=True)
    return folder

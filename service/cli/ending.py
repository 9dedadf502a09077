"""How a command ends: a status, and one sentence on stderr for whatever was raised."""

import contextlib
import os
import signal
import sys
from collections.abc import Callable

from pneuarm.controllers.arm.errors import NotConfirmed
from pneuarm.service.cli.values import UsageError
from pneuarm.service.processes.last_resort import sentence


def ended(command: Callable[[], int], *, stops: bool) -> int:
    """Run a command and return its status; one that ``stops`` the arm fails as NOT CONFIRMED."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:  # a path may have what the terminal's encoding has not
            reconfigure(errors="backslashreplace")
    try:
        status = _status(command)
    except SystemExit:  # of --help
        raise
    except BrokenPipeError:  # whoever read has enough
        _forget_stdout()
        return 0
    except BaseException as error:
        return _failed(error, stops)
    return status


def _status(command: Callable[[], int]) -> int:
    """Run a command; what it has printed is out when this returns."""
    try:
        status = command()
    except SystemExit:
        _flush()
        raise
    _flush()
    return status


def _failed(error: BaseException, stops: bool) -> int:
    """Say what went wrong, after what was printed before; return the status."""
    with contextlib.suppress(OSError):
        _flush()
    if isinstance(error, KeyboardInterrupt):
        if stops:
            say(str(NotConfirmed("it was interrupted before an answer came")))
        return 128 + (error.args[0] if error.args else signal.SIGINT)
    text = sentence(error)
    say(text if not stops or isinstance(error, NotConfirmed) else str(NotConfirmed(text)))
    return 2 if isinstance(error, UsageError) else 1


def say(text: str) -> None:
    """Print to stderr, where there is one."""
    if sys.stderr is not None:
        with contextlib.suppress(OSError):
            print(f"pneuarm: {text}", file=sys.stderr, flush=True)


def _flush() -> None:
    if sys.stdout is None:
        return
    try:
        sys.stdout.flush()
    except OSError as error:
        _forget_stdout()
        raise OSError(error.errno, error.strerror, "standard output") from error


def _forget_stdout() -> None:
    """Let what is still to be written go nowhere: Python would complain at its end."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())

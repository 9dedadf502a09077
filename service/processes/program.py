"""Another program that runs beside this process and ends with it."""

import ctypes
import os
import signal
import subprocess
from collections.abc import Sequence
from typing import Any

_PR_SET_PDEATHSIG = 1

#: Bound before any fork: the child of a process with threads must not load a library.
_PRCTL = ctypes.CDLL(None).prctl


def start_beside(
    command: Sequence[str], ending: signal.Signals = signal.SIGTERM, **streams: Any
) -> "subprocess.Popen[Any]":
    """Start a program in a session of its own: Ctrl-C is for this process, which ends it.

    However this process ends, also by SIGKILL, the program is sent ``ending``. ``streams`` are
    those of Popen. It must be started by a thread that lives as long as the process.
    """
    parent = os.getpid()

    def end_with_parent() -> None:
        _PRCTL(_PR_SET_PDEATHSIG, ending)
        if os.getppid() != parent:  # it ended before it was asked for
            os.kill(os.getpid(), ending)

    return subprocess.Popen(command, preexec_fn=end_with_parent, start_new_session=True, **streams)

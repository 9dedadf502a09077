"""What the operating system can do for the loop: priority, memory, no pauses."""

import contextlib
import ctypes
import gc
import os

_MCL_CURRENT, _MCL_ONFAULT = 1, 4


def lock_memory() -> bool:
    """Keep every page that is used in memory; False where the system does not allow it.

    Only what is mapped now: with a limit on locked memory, locking the future too would make a
    later allocation fail in the middle of a run.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    return bool(libc.mlockall(_MCL_CURRENT | _MCL_ONFAULT) == 0)


def take_priority(priority: int) -> bool:
    """Ask for first-in-first-out scheduling; False where the system does not allow it."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        return False
    return True


def freeze_garbage() -> None:
    """Take everything made so far out of the collector's sight: a full collection takes 18 ms."""
    gc.collect()
    gc.freeze()


def step_back(nice: int) -> None:
    """Let the loop and everything else go first."""
    with contextlib.suppress(OSError):
        os.nice(nice)


def step_forward(nice: int) -> None:
    """Go before ordinary programs, where the system allows it."""
    with contextlib.suppress(OSError):
        os.nice(-nice)


def drop_priority() -> None:
    """Go back to ordinary scheduling."""
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))

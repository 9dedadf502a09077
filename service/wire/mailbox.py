"""What Zenoh hands over, key by key: the newest of it, on a thread of the key's own.

Zenoh's own callbacks wait for each other: a queue of 256 that is full stops the thread that reads
from the network, and with that the stop behind it. Here what nobody gets round to is dropped, the
oldest first, before it costs anything.
"""

import threading
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import zenoh

T = TypeVar("T")


def last_resort(work: Callable[[T], None], refuse: Callable[[T, str], None]) -> Callable[[T], None]:
    """Return ``work`` so that whatever it raises is one sentence for ``refuse``."""

    def guarded(item: T) -> None:
        try:
            work(item)
        except Exception as error:  # a message that nobody thought of must not end the thread
            refuse(item, sentence_of(error))

    return guarded


def sentence_of(error: Exception) -> str:
    """Say what went wrong inside, and where, for a report."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    where = ""
    if trace is not None:
        where = f" in {trace.tb_frame.f_globals.get('__name__', '?')}, line {trace.tb_lineno}"
    return (
        f"it could not be handled ({type(error).__name__}{where}: {str(error)[:150]}) and changed "
        "nothing; please report it"
    )


def serve(declare: Callable[[Any], Iterable[T]], work: Callable[[T], None], size: int) -> object:
    """Declare with room for the ``size`` newest, and work on them one by one until the end.

    ``declare`` takes Zenoh's handler. Returns what it declared; to be kept.
    """
    declared = declare(zenoh.handlers.RingChannel(size))

    def run() -> None:
        try:
            for item in declared:
                work(item)
        except zenoh.ZError:
            return  # the session was closed

    threading.Thread(target=run, name="mailbox", daemon=True).start()
    return declared


def at_once(work: Callable[[T], None]) -> Any:
    """Return a handler that works on Zenoh's own thread: for the stop, which waits for nobody."""
    return zenoh.handlers.Callback(work, lambda: None, indirect=False)

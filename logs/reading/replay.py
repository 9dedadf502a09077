"""A log in the order and at the pace in which it was recorded; the clock is an argument."""

from collections.abc import Callable, Iterator

from pneuarm.logs.reading.reader import Entry, LogReader


def paced(
    reader: LogReader,
    speed: float,
    loop: bool,
    clock_s: Callable[[], float],
    sleep_s: Callable[[float], None],
) -> Iterator[Entry]:
    """Yield entries when their time has come; ``speed`` 2 is twice as fast. ``loop`` never ends."""
    while True:
        began_s, first_ns = clock_s(), None
        for entry in reader:
            first_ns = entry.time_unix_ns if first_ns is None else first_ns
            due_s = began_s + (entry.time_unix_ns - first_ns) * 1e-9 / speed
            if (wait_s := due_s - clock_s()) > 0:
                sleep_s(wait_s)
            yield entry
        if not loop:
            return

"""A log in the order and at the pace in which it was recorded; the clock is an argument."""

from collections.abc import Callable, Iterator

from pneuarm.logs.reading.reader import Entry, LogReader

#: Nothing is written down for this long only where something is missing.
HOLE_S = 10.0


def paced(
    reader: LogReader,
    speed: float,
    loop: bool,
    clock_s: Callable[[], float],
    sleep_s: Callable[[float], None],
    tell: Callable[[str], None] = lambda text: None,
) -> Iterator[Entry]:
    """Yield entries when their time has come; ``speed`` 2 is twice as fast. ``loop`` never ends.

    Where the log has a hole it is told, and not waited for.
    """
    while True:
        began_s = clock_s()
        first_ns = newest_ns = None
        for entry in reader:
            time_ns = entry.time_unix_ns
            if first_ns is None or newest_ns is None:
                first_ns = newest_ns = time_ns
            hole_s = (time_ns - newest_ns) * 1e-9
            if hole_s > HOLE_S:
                at_s = (newest_ns - first_ns) * 1e-9
                tell(f"nothing was recorded for {hole_s:.1f} s from {at_s:.1f} s on: skipped")
                first_ns += time_ns - newest_ns
            newest_ns = max(newest_ns, time_ns)
            due_s = began_s + (time_ns - first_ns) * 1e-9 / speed
            if (wait_s := due_s - clock_s()) > 0:
                sleep_s(wait_s)
            yield entry
        if not loop:
            return

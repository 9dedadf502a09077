"""One event for people: on the terminal, in the journal, and as `pneuarm state` shows it."""

from datetime import datetime, timezone

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.printable import name_of, printable

_LONGEST = 2000


def event_line(event: pb.Event) -> str:
    """One event for a terminal: time, level, who, what, why, what to do."""
    time = datetime.fromtimestamp(event.time_unix_ns / 1e9, timezone.utc)
    clock = time.strftime("%H:%M:%S.%f")[:-3]
    line = f"{clock} {name_of(pb.Level, event.level):7} {event.source}: {event.text}"
    if event.repeats:
        line += f" ({event.repeats} times)"
    if event.client_id:
        line += f" [{event.client_id}]"
    if event.cause:
        line += f" (cause: {event.cause})"
    if event.remedy:
        line += f" -> {event.remedy}"
    return printable(line, _LONGEST)

"""What repeats is told once, and then counted: an event a second, however many there are.

Everything that is told goes into the log and onto the terminal; whoever can make something happen
again and again could otherwise fill both. Pure: the time is that of the events.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass

from pneuarm.logs.schema import pneuarm_pb2 as pb

_AGAIN_NS = 1_000_000_000

#: Different events in a second; a stranger may call itself otherwise in every message.
_MOST_IN_A_SECOND = 20

_NUMBER = re.compile(r"[-+]?(\d[\d.]*(e[-+]?\d+)?|\bnan\b|\binf\b)")


def sameness(event: pb.Event) -> tuple[str, str, str]:
    """Return what two events have in common that say the same."""
    return event.code, event.client_id, _NUMBER.sub("#", event.text)


@dataclass
class _Lasting:
    told_ns: int
    newest: pb.Event | None = None
    repeats: int = 0


class Telling:
    """Passes events on: at once what is new or comes with another mode, else counted.

    Two events say the same when nothing but their numbers differs. The second and later ones are
    told a second after the one before, the newest of them, with how many there were in
    ``repeats``. Of what is new at most 20 are told in a second; the rest is counted together.
    """

    def __init__(self, write: Callable[[pb.Event], None]) -> None:
        self._write = write
        self._lasting: dict[tuple[str, str, str], _Lasting] = {}
        self._mode: int | None = None
        self._surplus = _Lasting(0)
        self._second_ns = self._in_second = 0

    def tell(self, event: pb.Event) -> None:
        """Take an event; its ``time_unix_ns`` is now."""
        changed, self._mode = event.mode != self._mode, event.mode
        key = sameness(event)
        lasting = self._lasting.get(key)
        if changed or (lasting is None and self._is_room(event.time_unix_ns)):
            event.repeats = lasting.repeats + 1 if lasting and lasting.repeats else 0
            self._lasting[key] = _Lasting(event.time_unix_ns)
            self._write(event)
        elif lasting is None:
            self._surplus.newest = event
            self._surplus.repeats += 1
        else:
            lasting.newest, lasting.repeats = event, lasting.repeats + 1
            self.step(event.time_unix_ns)

    def _is_room(self, now_ns: int) -> bool:
        if now_ns - self._second_ns >= _AGAIN_NS:
            self._second_ns, self._in_second = now_ns, 0
        self._in_second += 1
        return self._in_second <= _MOST_IN_A_SECOND

    def step(self, now_ns: int) -> None:
        """Tell what was counted, once a second; forget what has not happened again."""
        due = [key for key, it in self._lasting.items() if now_ns - it.told_ns >= _AGAIN_NS]
        for key in due:
            lasting = self._lasting.pop(key)
            if (event := lasting.newest) is not None:
                event.repeats, event.time_unix_ns = lasting.repeats, now_ns
                self._lasting[key] = _Lasting(now_ns)
                self._write(event)
        if self._surplus.newest is not None and now_ns - self._surplus.told_ns >= _AGAIN_NS:
            self._tell_surplus(self._surplus.newest, now_ns)

    def _tell_surplus(self, newest: pb.Event, now_ns: int) -> None:
        number, self._surplus = self._surplus.repeats, _Lasting(now_ns)
        self._write(
            pb.Event(
                time_unix_ns=now_ns,
                level=newest.level,
                source=newest.source,
                code="not_told",
                text=f"{number} more events, too many to be told one by one; the newest: "
                f"{newest.text}",
                mode=newest.mode,
                repeats=number,
            )
        )

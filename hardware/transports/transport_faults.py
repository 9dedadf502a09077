"""Faults of an emulated device's transport, injected by words, and the console that takes them.

``silence S`` (no answer for S seconds), ``slow MS`` (every answer so much later; 0 ends it),
``reset`` (the connection breaks once), ``exception N`` (N answers refuse), ``wrong`` (the next
answer belongs to another request), ``garbage`` (the next answer is noise), ``unplug S`` (nobody
is there for S seconds). ``clear`` ends them all, together with those of the physics.
"""

import sys
import threading
from collections.abc import Callable

from pneuarm.controllers.arm.errors import InvalidInput, PneuarmError

TRANSPORT_WORDS = (
    "silence S",
    "slow MS",
    "reset",
    "exception N",
    "wrong",
    "garbage",
    "unplug S",
)
_COUNTS = {line.split()[0]: len(line.split()) - 1 for line in TRANSPORT_WORDS}


class TransportFaults:
    """What an emulator asks before it answers; times on the emulator's own clock (s)."""

    def __init__(self) -> None:
        self._silent_until_s = self._unplugged_until_s = -1.0
        self._exceptions = 0
        self._once: set[str] = set()
        self.delay_s = 0.0

    def inject(self, words: str, now_s: float) -> bool:
        """Take one line; return whether it is a fault of the transport. Raises InvalidInput."""
        name, *values = words.split() or [""]
        if name == "clear":
            self.__init__()  # type: ignore[misc]
            return False  # the physics is cleared as well
        if name not in _COUNTS:
            return False
        numbers = [_number(words, value) for value in values]
        if len(numbers) != _COUNTS[name]:
            raise InvalidInput(f"fault {words!r}: allowed: {', '.join(TRANSPORT_WORDS)}")
        match name:
            case "silence":
                self._silent_until_s = now_s + numbers[0]
            case "unplug":
                self._unplugged_until_s = now_s + numbers[0]
            case "slow":
                self.delay_s = numbers[0] * 1e-3
            case "exception":
                self._exceptions = int(numbers[0])
            case _:
                self._once.add(name)
        return True

    def silent(self, now_s: float) -> bool:
        """Whether nothing is answered now."""
        return now_s < self._silent_until_s

    def unplugged(self, now_s: float) -> bool:
        """Whether nobody is there now."""
        return now_s < self._unplugged_until_s

    def refuses(self) -> bool:
        """Whether this answer is an exception."""
        self._exceptions -= 1
        return self._exceptions >= 0

    def once(self, name: str) -> bool:
        """Whether ``reset``, ``wrong`` or ``garbage`` is due; it then is no more."""
        due = name in self._once
        self._once.discard(name)
        return due


def _number(words: str, value: str) -> float:
    try:
        number = float(value)
    except ValueError:
        number = -1.0
    if not 0.0 <= number < 1e6:
        raise InvalidInput(f"fault {words!r}: {value!r} is no number of 0 or more")
    return number


def start_console(inject: Callable[[str], None], words: tuple[str, ...]) -> None:
    """Take fault words as lines on stdin, on a thread of its own; a wrong one is answered so."""

    def listen() -> None:
        for line in sys.stdin:
            if not line.strip():
                continue
            try:
                inject(line.strip())
                print(f"fault      {line.strip()}", flush=True)
            except PneuarmError as error:
                print(f"{error}; allowed: {', '.join(words)}", flush=True)

    threading.Thread(target=listen, daemon=True).start()

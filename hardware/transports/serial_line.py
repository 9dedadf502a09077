"""A serial port as lines of bytes; whatever goes wrong with it is a HardwareError.

The timeouts are the transport's own. The time of the control loop does not come in here.
"""

import os
import select
import termios
import time
from collections.abc import Callable
from typing import TypeVar

import serial

from pneuarm.controllers.arm.errors import HardwareError

#: A line longer than this is no line of any of these devices.
LONGEST_LINE = 2048
#: So many lines that mean nothing, one after the other, and the device is no longer understood.
MOST_BAD_LINES = 25
#: How long one line may take to leave (s).
WRITE_TIMEOUT_S = 0.2

_READ_BYTES = 1 << 16
#: How long one look for bytes lasts at most while something is waited for (s).
_LOOK_S = 0.02

T = TypeVar("T")


class SerialLine:
    """One port, opened for one host alone; ``what`` names the device in every error."""

    def __init__(self, device: str, baud: int, what: str, remedy: str) -> None:
        self._device, self._baud = device, baud
        self._what, self._remedy = what, remedy
        self._port: serial.Serial | None = None
        self._rest = b""
        self._bad_in_a_row = 0

    def open(self) -> None:
        """Open the port; raises HardwareError with the reason and what to do."""
        self.close()
        try:
            self._port = serial.Serial(
                self._device,
                self._baud,
                timeout=0,
                write_timeout=WRITE_TIMEOUT_S,
                exclusive=True,
            )
        except (serial.SerialException, OSError, ValueError, termios.error) as error:
            raise self.error(f"cannot be opened ({_reason(error)})") from error
        self._rest, self._bad_in_a_row = b"", 0

    def close(self) -> None:
        """Let the port go. Safe to call twice, and without the device."""
        port, self._port = self._port, None
        if port is not None:
            try:
                port.close()
            except (serial.SerialException, OSError, termios.error):
                return  # the device went first; nothing of it is left to be closed

    def error(self, what_happened: str) -> HardwareError:
        """Make one sentence: the device, what happened, what to do."""
        return HardwareError(f"{self._what} at {self._device} {what_happened}: {self._remedy}")

    def send(self, line: bytes) -> None:
        """Send one line; ``line`` has its own end."""
        try:
            self._opened().write(line)
        except (serial.SerialException, OSError, termios.error) as error:
            raise self.error(f"takes no bytes any more ({_reason(error)})") from error

    def receive(self, wait_s: float) -> list[bytes]:
        """Return the whole lines that have come, waiting at most ``wait_s`` for the first bytes."""
        port = self._opened()
        try:
            if wait_s > 0.0:
                select.select([port.fileno()], [], [], wait_s)
            received: bytes = port.read(_READ_BYTES)
        except (serial.SerialException, OSError, termios.error, ValueError) as error:
            raise self.error(f"has gone ({_reason(error)})") from error
        *lines, self._rest = (self._rest + received).split(b"\n")
        if len(self._rest) > LONGEST_LINE:
            lines.append(self._rest)
            self._rest = b""
        return [line.strip(b"\r") for line in lines]

    def take_until(self, take: Callable[[bytes], bool], wait_s: float) -> None:
        """Hand every line to ``take`` until it has said True of one, or ``wait_s`` is over.

        What has come already is taken first, all of it. Lines that are empty mean nothing.
        """
        give_up_s = time.monotonic() + wait_s
        left_s, found = 0.0, False
        while not found and left_s >= 0.0:
            for line in filter(None, self.receive(left_s)):
                found |= take(line)
            left_s = give_up_s - time.monotonic()

    def wait_for(self, find: Callable[[bytes], T | None], timeout_s: float, what: str) -> T:
        """Return the first thing that ``find`` makes of a line; raises HardwareError without."""
        give_up_s = time.monotonic() + timeout_s
        newest = b""
        while time.monotonic() < give_up_s:
            for line in self.receive(_LOOK_S):
                newest = line or newest
                if (found := find(line)) is not None:
                    return found
        heard = f"the last line was {shown(newest)}" if newest else "it said nothing"
        raise self.error(f"did not answer {what} within {timeout_s:g} s ({heard})")

    def count(self, understood: bool, line: bytes) -> None:
        """Count a line; raises HardwareError when too many in a row were not understood."""
        self._bad_in_a_row = 0 if understood else self._bad_in_a_row + 1
        if self._bad_in_a_row > MOST_BAD_LINES:
            bad, self._bad_in_a_row = self._bad_in_a_row, 0
            raise self.error(f"sent {bad} lines that mean nothing, the last {shown(line)}")

    def _opened(self) -> serial.Serial:
        if self._port is None:
            raise HardwareError(f"{self._what} is not connected: call connect() first")
        return self._port


def shown(line: bytes) -> str:
    """Return the bytes of a line for an error, cut where they are many."""
    return repr(line[:60])[1:] + ("..." if len(line) > 60 else "")


def _reason(error: BaseException) -> str:
    """Return what the system says, or the library where the system has not said anything."""
    said: BaseException | None = error
    while said is not None:  # the library keeps the system's own error behind some of its own
        number = said.args[0] if isinstance(said, termios.error) else getattr(said, "errno", None)
        if isinstance(number, int):
            return os.strerror(number)
        said = said.__context__
    return str(error)[:100]

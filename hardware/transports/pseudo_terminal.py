"""An emulated serial device on a pseudo-terminal, under a path that stays when it is unplugged.

The path is a symbolic link in a folder of its own: plugged in again, the device has a new
terminal, as a USB adapter may have, and the same path.
"""

import contextlib
import os
import select
import tempfile
import threading
import time
import tty
from collections import deque
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Protocol

from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.device import Emulation
from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.emulation.faults import PHYSICAL_WORDS
from pneuarm.hardware.transports.serial_faults import SERIAL_WORDS, SerialFaults

#: How long one pass waits for bytes at most (s), which is how punctual telemetry is.
_PASS_S = 0.002


#: How much of its physics an emulated arm calculates in one pass at most (s).
_LARGEST_ADVANCE_S = 0.02


class SlowMotion:
    """Time of an emulated arm: on a busy machine it falls behind, and its host need not wait."""

    def __init__(self) -> None:
        self._now_s: float | None = None

    def until(self, time_s: float) -> float:
        """Return up to when to calculate now; it catches up where it can."""
        if self._now_s is None:
            self._now_s = time_s
        self._now_s = min(time_s, self._now_s + _LARGEST_ADVANCE_S)
        return self._now_s


class SerialEmulator(Protocol):
    """A device that answers bytes with bytes."""

    def boot(self) -> None:
        """Start as after power came."""
        ...

    def take(self, received: bytes, time_s: float) -> bytes:
        """Take what the host has sent; return the answer."""
        ...

    def advance(self, time_s: float) -> bytes:
        """Let time pass; return what the device says by itself."""
        ...


class PseudoTerminal:
    """Runs a device on a terminal; ``path`` is what a host opens.

    One thread calls :meth:`run` or, through :meth:`start`, a thread of its own does.
    """

    def __init__(self, emulator: SerialEmulator, faults: SerialFaults | None = None) -> None:
        self.emulator, self.faults = emulator, faults or SerialFaults()
        self._folder = tempfile.TemporaryDirectory(prefix="pneuarm-serial-")
        self.path = Path(self._folder.name) / "tty"
        self._host_end = self._device_end = -1
        self._pulled = False  # by unplug(), until plug()
        self._late: deque[tuple[float, bytes]] = deque()
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        self.lock = threading.Lock()
        self._plug_in()

    def __enter__(self) -> "PseudoTerminal":
        """Start a thread that is the device."""
        self._thread = threading.Thread(target=self.run, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *unused: object) -> None:
        """End it, and take the path away."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join(5.0)
        self._pull_out()
        self._folder.cleanup()

    def unplug(self) -> None:
        """Take the device away from its host."""
        with self.lock:
            self._pulled = True
            self._pull_out()

    def plug(self) -> None:
        """Bring it back; it had power all the while."""
        with self.lock:
            self._pulled = False
            self._plug_in()

    def run(self) -> None:
        """Be the device until the end."""
        while not self._ended.is_set():
            if self._device_end >= 0:
                with contextlib.suppress(OSError, ValueError):
                    select.select([self._device_end], [], [], _PASS_S)
            else:
                time.sleep(_PASS_S)
            with self.lock:
                self._pass(time.monotonic())

    def _pass(self, now_s: float) -> None:
        wanted = not (self._pulled or self.faults.unplugged(now_s))
        if self.faults.once("reset"):
            self._pull_out()
            self.emulator.boot()
        if wanted and self._device_end < 0:
            self._plug_in()
        elif not wanted:
            self._pull_out()
        sent = self.emulator.take(self._read(), now_s) + self.emulator.advance(now_s)
        self._late.append((now_s + self.faults.delay_s, self.faults.bend(sent, now_s)))
        while self._late and self._late[0][0] <= now_s:
            self._write(self._late.popleft()[1])

    def _read(self) -> bytes:
        try:
            return os.read(self._device_end, 1 << 16) if self._device_end >= 0 else b""
        except OSError:  # nothing there
            return b""

    def _write(self, said: bytes) -> None:
        """Send it; what a host does not fetch is lost, as in a device's own buffer."""
        if said and self._device_end >= 0:
            with contextlib.suppress(OSError):
                os.write(self._device_end, said)

    def _plug_in(self) -> None:
        if self._device_end >= 0:
            return
        try:
            self._device_end, self._host_end = os.openpty()
        except OSError as error:
            raise HardwareError(
                f"no pseudo-terminal for an emulated device ({error.strerror}): this system must "
                "have some left"
            ) from error
        # Without this the terminal repeats to the device what the device says.
        tty.setraw(self._host_end)
        os.set_blocking(self._device_end, False)
        self.path.symlink_to(os.ttyname(self._host_end))

    def _pull_out(self) -> None:
        for end in (self._device_end, self._host_end):
            if end >= 0:
                os.close(end)
        self._device_end = self._host_end = -1
        self._late.clear()
        self.path.unlink(missing_ok=True)


@contextlib.contextmanager
def emulation_on_a_terminal(
    emulator: SerialEmulator, arm: EmulatedArm, table: Mapping[str, object]
) -> Iterator[Emulation]:
    """Run a serial device while the context lasts; ``table`` holds its keys but the port's."""
    with PseudoTerminal(emulator, SerialFaults()) as terminal:

        def inject(words: str) -> None:
            with terminal.lock:
                if not terminal.faults.inject(words, time.monotonic()):
                    arm.inject(words)

        whole = {"device": str(terminal.path), **table}
        yield Emulation(whole, inject, SERIAL_WORDS + PHYSICAL_WORDS)

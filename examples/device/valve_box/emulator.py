"""A box without the box: its lines on a port of loopback, with an emulated arm behind them."""

import socket
import threading
import time

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.hardware.emulation.emulation import EmulatedArm
from valve_box.protocol import WATCHDOG_S, answer_line, values_pa

#: Faults of its transport; those of the air are the emulated arm's.
WORDS = ("unplug S",)

#: How long one look for a line lasts at most (s).
_LOOK_S = 0.01


class EmulatedValveBox:
    """Serves one host at a time on a port of loopback that stays the same."""

    def __init__(self, arm: EmulatedArm) -> None:
        self._arm = arm
        self._lock = threading.Lock()
        self._n_sections = arm.n_chambers // 3
        self._unplugged_until_s, self._ended = 0.0, False
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listening.getsockname()[1])
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> "EmulatedValveBox":
        self._thread.start()
        return self

    def __exit__(self, *unused: object) -> None:
        self._ended = True
        self._thread.join(5.0)
        self._listening.close()

    def inject(self, words: str) -> None:
        """Break something, or ``clear`` it; raises InvalidInput for what is no fault."""
        name, *values = words.split()
        if name == "clear":
            self._unplugged_until_s = 0.0
        if name != "unplug":
            with self._lock:
                self._arm.inject(words)
            return
        try:
            self._unplugged_until_s = time.monotonic() + float(*values)
        except (TypeError, ValueError) as error:
            raise InvalidInput(f"fault {words!r}: unplug S, for S seconds") from error

    def _plugged(self) -> bool:
        return time.monotonic() >= self._unplugged_until_s

    def _run(self) -> None:
        self._listening.settimeout(_LOOK_S)
        while not self._ended:
            try:
                host = self._listening.accept()[0]
            except TimeoutError:
                self._pass(b"", WATCHDOG_S)
                continue
            with host:
                self._serve(host)

    def _serve(self, host: socket.socket) -> None:
        host.settimeout(_LOOK_S)
        rest, heard_s = b"", time.monotonic()
        while self._plugged() and not self._ended:
            try:
                received = host.recv(4096)
            except TimeoutError:
                self._pass(b"", time.monotonic() - heard_s)
                continue
            except OSError:
                return
            if not received:
                return
            heard_s = time.monotonic()
            *lines, rest = (rest + received).split(b"\n")
            for line in lines:
                host.sendall(self._pass(line, 0.0))

    def _pass(self, line: bytes, silent_s: float) -> bytes:
        """Let time pass in the arm; obey a line and answer it, or empty the arm after silence."""
        with self._lock:
            now_s = time.monotonic()
            self._arm.advance(now_s)
            if line.startswith(b"P"):
                self._arm.set_pressures_pa(values_pa(line[1:], self._n_sections), now_s)
            elif silent_s >= WATCHDOG_S and self._arm.setpoints_pa.any():
                self._arm.zero_all(now_s, "watchdog")
            return answer_line(self._arm.pressures_pa)

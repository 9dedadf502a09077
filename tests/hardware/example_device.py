"""The device of the example adapter: valves on a thread, with an emulated arm behind them."""

import socket
import threading
import time

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.hardware.emulation.emulation import EmulatedArm

MBAR = 100.0
WATCHDOG_S = 0.2


class ValveBoxDevice:
    """Serves one host at a time on a port of loopback that stays the same."""

    def __init__(self, arm: EmulatedArm) -> None:
        self._arm = arm
        self._lock = threading.Lock()
        self._plugged, self._ended = True, False
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listening.getsockname()[1])
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> "ValveBoxDevice":
        self._thread.start()
        return self

    def __exit__(self, *unused: object) -> None:
        self._ended = True
        self._thread.join(5.0)
        self._listening.close()

    def told_pa(self) -> Array:
        """Return what the valves are told now."""
        with self._lock:
            return self._arm.setpoints_pa.copy()

    def unplug(self) -> None:
        self._plugged = False
        time.sleep(0.05)

    def plug(self) -> None:
        self._plugged = True

    def _run(self) -> None:
        self._listening.settimeout(0.01)
        while not self._ended:
            try:
                host = self._listening.accept()[0]
            except TimeoutError:
                self._pass(b"", WATCHDOG_S)
                continue
            with host:
                self._serve(host)

    def _serve(self, host: socket.socket) -> None:
        host.settimeout(0.01)
        rest, heard_s = b"", time.monotonic()
        while self._plugged and not self._ended:
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
                self._arm.set_pressures_pa(MBAR * np.array(line.split()[1:], dtype=float), now_s)
            elif silent_s >= WATCHDOG_S and self._arm.setpoints_pa.any():
                self._arm.zero_all(now_s, "watchdog")
            measured = self._arm.pressures_pa.reshape(-1) / MBAR
        return " ".join(f"{value:.0f}" for value in measured).encode() + b"\n"

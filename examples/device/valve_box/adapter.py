"""The valve box behind the interface of every device: one line there, one line back."""

import socket
from contextlib import suppress

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.channels import CallOrder, StepCommand
from pneuarm.hardware.interface import Measurement
from valve_box.protocol import MEASURE, STEP_PA, set_line, values_pa

WHAT = "the valve box"


class ValveBox:
    """One box; it satisfies :class:`pneuarm.hardware.interface.Hardware`."""

    def __init__(self, arm: Arm, host: str, port: int, timeout_s: float) -> None:
        """Check the configuration here, and touch no device."""
        self._arm, self._address, self._timeout_s = arm, (host, port), timeout_s
        self._command = StepCommand(arm, STEP_PA, WHAT)
        self._order = CallOrder(WHAT)
        self._socket: socket.socket | None = None

    def connect(self) -> None:
        """Open it and set zeros before anything else: a dead host may have left pressure in it."""
        self.close()
        try:
            self._socket = socket.create_connection(self._address, self._timeout_s)
        except OSError as error:
            raise self._lost(error) from error
        self._order.begin()
        self._set(np.zeros((self._arm.n_sections, 3)))

    def read(self, time_s: float) -> Measurement:
        """Return what is measured now; a box without length sensors leaves them NaN."""
        self._order.check(time_s)
        pressures_pa = self._ask(MEASURE)
        return Measurement(pressures_pa, np.full_like(pressures_pa, np.nan))

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        """Send whole millibars, and return them: the guard's slew counts from what was sent."""
        self._order.check(time_s)
        sendable_pa = self._command.sendable_pa(pressures_pa)
        self._set(sendable_pa)
        return sendable_pa

    def vent(self, time_s: float) -> None:
        """Set zeros, whatever the time says: venting is never refused."""
        self._order.at_any_time(time_s)
        self._set(np.zeros((self._arm.n_sections, 3)))

    def close(self) -> None:
        """Leave no pressure behind on any way out; what is gone already is no error here."""
        if self._socket is not None:
            with suppress(HardwareError):
                self._set(np.zeros((self._arm.n_sections, 3)))
            self._socket.close()
        self._socket = None
        self._order.end()

    def _set(self, pressures_pa: Array) -> None:
        self._ask(set_line(pressures_pa))

    def _ask(self, line: bytes) -> Array:
        """Send a line and return the answer, (n_sections, 3) in Pa; anything else is an error."""
        if self._socket is None:
            raise HardwareError(f"{WHAT} is not connected: call connect() first")
        try:
            self._socket.sendall(line)
            answer = b""
            while not answer.endswith(b"\n"):
                received = self._socket.recv(1024)
                if not received or len(answer) > 1024:
                    raise OSError("the connection was closed" if not received else "no line")
                answer += received
            return values_pa(answer, self._arm.n_sections)
        except (OSError, ValueError) as error:
            raise self._lost(error) from error

    def _lost(self, error: Exception) -> HardwareError:
        """One sentence for the person in the laboratory: what, where, what to do."""
        host, port = self._address
        return HardwareError(
            f"{WHAT} at {host}:{port} does not answer as it must ({error}): check its power, its "
            "cable and its address"
        )

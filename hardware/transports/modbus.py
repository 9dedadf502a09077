"""A terminal behind Modbus TCP: blocks of holding registers, one connection, no second tries.

A request is never repeated and a connection never opened behind the caller's back: whoever drives
an arm must know that the terminal was away.
"""

import logging
import socket
from collections.abc import Callable, Iterable

from pymodbus import ModbusException
from pymodbus.client import ModbusTcpClient
from pymodbus.pdu import ExceptionResponse, ModbusPDU

from pneuarm.controllers.arm.errors import HardwareError

#: The library tells on a terminal what is raised here anyway.
logging.getLogger("pymodbus").setLevel(logging.CRITICAL + 1)

_CONNECT_TIMEOUT_S = 1.0
_NO_SUCH_REGISTER = 2
_EXCEPTIONS = {
    1: "it does not know the function",
    _NO_SUCH_REGISTER: "it has no such register",
    3: "it does not take the value",
    4: "it has failed inside",
    6: "it is busy",
}


class ModbusRefusal(HardwareError):
    """The terminal has answered with a Modbus exception, whose number is ``code``."""

    def __init__(self, text: str, code: int) -> None:
        super().__init__(text)
        self.code = code


class ModbusTerminal:
    """One terminal; ``name`` is the table of the configuration that describes it."""

    def __init__(self, name: str, host: str, port: int, unit_id: int, timeout_s: float) -> None:
        self._name, self._unit_id, self._timeout_s = name, unit_id, timeout_s
        self._where = f"{name}: the terminal at {host}:{port}"
        self._address = host, port
        self._client: ModbusTcpClient | None = None

    @property
    def connected(self) -> bool:
        """Whether there is a connection."""
        return self._client is not None and self._client.connected

    def connect(self) -> None:
        """Open the connection; raises HardwareError where nobody answers."""
        self.close()
        host, port = self._address
        client = ModbusTcpClient(host, port=port, timeout=self._timeout_s, retries=0)
        try:
            opened = socket.create_connection((host, port), timeout=_CONNECT_TIMEOUT_S)
        except OSError as error:
            raise HardwareError(
                f"{self._where} cannot be reached ({error.strerror or error}); check its power "
                f"and cable, and {self._name}.host and port"
            ) from error
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        client.socket = opened
        self._client = client

    def read(self, address: int, count: int) -> list[int]:
        """Return ``count`` holding registers, function 03."""
        client = self._open()
        what = f"reading registers {address} to {address + count - 1}"
        answer = self._ask(
            what,
            lambda: client.read_holding_registers(address, count=count, device_id=self._unit_id),
        )
        registers = list(answer.registers)
        if answer.function_code != 3 or len(registers) != count:
            raise self._lost(f"answered {what} with something else")
        return registers

    def read_wired(self, block: tuple[int, int], wired: str) -> list[int]:
        """Return a block, as :meth:`read`; where it is not there, ask whether ``wired`` is."""
        try:
            return self.read(*block)
        except ModbusRefusal as error:
            if error.code != _NO_SUCH_REGISTER:
                raise
            raise HardwareError(f"{error}: does the terminal have {wired}?") from error

    def write(self, address: int, values: list[int]) -> None:
        """Set holding registers from ``address`` on, function 16."""
        client = self._open()
        what = f"writing registers {address} to {address + len(values) - 1}"
        answer = self._ask(
            what, lambda: client.write_registers(address, values, device_id=self._unit_id)
        )
        told = (answer.function_code, answer.address, answer.count)
        if told != (16, address, len(values)):
            raise self._lost(f"answered {what} with something else")

    def _open(self) -> ModbusTcpClient:
        if self._client is None or not self._client.connected:
            raise HardwareError(f"{self._where} is not connected: call connect() first")
        return self._client

    def _ask(self, what: str, request: Callable[[], ModbusPDU]) -> ModbusPDU:
        try:
            answer = request()
        except (ModbusException, OSError) as error:
            if self.connected:
                reason = f"did not answer {what} within {self._timeout_s * 1e3:g} ms"
            else:
                reason = f"closed the connection while {what}"
            raise self._lost(reason) from error
        if isinstance(answer, ExceptionResponse):
            code = answer.exception_code
            reason = _EXCEPTIONS.get(code, "it gave no known reason")
            text = f"{self._where} refused {what}: {reason} (Modbus exception {code})"
            raise ModbusRefusal(text, code)
        return answer

    def _lost(self, reason: str) -> HardwareError:
        """Drop a connection whose next answer could be this one's; return what to raise."""
        self.close()
        return HardwareError(f"{self._where} {reason}; check its cable and what else asks it")

    def close(self) -> None:
        """Close the connection. Safe to call twice."""
        if self._client is not None:
            self._client.close()  # type: ignore[no-untyped-call]
        self._client = None


def runs(numbers: Iterable[int]) -> list[tuple[int, int]]:
    """Return the runs of consecutive numbers as (first, how many); what lies between is others'."""
    found: list[tuple[int, int]] = []
    for number in sorted(set(numbers)):
        if found and number == sum(found[-1]):
            found[-1] = found[-1][0], found[-1][1] + 1
        else:
            found.append((number, 1))
    return found


def from_signed(value: int) -> int:
    """Return the register of a number from -32768 to 65535: two's complement below zero."""
    return value & 0xFFFF


def to_signed(register: int) -> int:
    """Return the number from -32768 to 32767 that a register means in two's complement."""
    return register - 0x10000 if register >= 0x8000 else register


def milliseconds_to_registers(milliseconds: int, words: int) -> list[int]:
    """Return a time in one register, or in two with the low word first."""
    return [milliseconds >> (16 * index) & 0xFFFF for index in range(words)]

"""The transport of emulated Modbus terminals: a server on loopback that can be made to fail."""

import asyncio
import contextlib
import threading
import time
from typing import Protocol

from pymodbus.framer import FramerSocket
from pymodbus.pdu import DecodePDU, ExceptionResponse, ModbusPDU
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersResponse,
    WriteMultipleRegistersResponse,
    WriteSingleRegisterResponse,
)

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.transports.transport_faults import TransportFaults

LOOPBACK = "127.0.0.1"

_ILLEGAL_FUNCTION, _ILLEGAL_ADDRESS, _BUSY = 1, 2, 6
_STEP_S = 0.01


class EmulatedTerminal(Protocol):
    """The registers of a terminal, and what happens in it; times on the monotonic clock (s)."""

    def read(self, address: int, count: int) -> list[int] | None:
        """Return registers, None where there are none."""
        ...

    def write(self, address: int, values: list[int], now_s: float) -> bool:
        """Set registers; False where there are none."""
        ...

    def touched(self, now_s: float) -> None:
        """Somebody has asked for something."""
        ...

    def step(self, now_s: float) -> None:
        """Let time pass: the air, the watchdog."""
        ...


class ModbusServer:
    """Serves one terminal until it is cancelled."""

    def __init__(self, terminal: EmulatedTerminal, faults: TransportFaults) -> None:
        self._terminal, self._faults = terminal, faults
        self._framer = FramerSocket(DecodePDU(is_server=True))
        self._connections: set[asyncio.StreamWriter] = set()

    async def run(self, host: str, port: int, ready: "asyncio.Future[int] | None" = None) -> None:
        """Listen, and let time pass in the terminal; ``ready`` gets the port."""
        server = await asyncio.start_server(self._serve, host, port)
        port = server.sockets[0].getsockname()[1]
        if ready is not None:
            ready.set_result(port)
        try:
            while True:
                now_s = time.monotonic()
                self._terminal.step(now_s)
                if self._faults.unplugged(now_s) == server.is_serving():
                    server = await self._plug(server, host, port)
                if self._faults.unplugged(now_s) or self._faults.once("reset"):
                    self._break_connections()
                await asyncio.sleep(_STEP_S)
        finally:
            server.close()
            self._break_connections()

    async def _plug(self, server: asyncio.Server, host: str, port: int) -> asyncio.Server:
        """Stop listening, or listen again."""
        if server.is_serving():
            server.close()
            return server
        return await asyncio.start_server(self._serve, host, port)

    def _break_connections(self) -> None:
        for writer in self._connections:
            writer.transport.abort()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._connections.add(writer)
        data = b""
        with contextlib.suppress(OSError, asyncio.CancelledError):
            while received := await reader.read(4096):
                data += received
                while True:
                    used, request = self._framer.handleFrame(data, 0, 0)
                    data = data[used:]
                    if request is None:
                        break
                    await self._respond(request, writer)
        self._connections.discard(writer)
        writer.close()

    async def _respond(self, request: ModbusPDU, writer: asyncio.StreamWriter) -> None:
        faults, now_s = self._faults, time.monotonic()
        if faults.silent(now_s):
            return
        self._terminal.touched(now_s)
        code = _BUSY if faults.refuses() else 0
        answer = ExceptionResponse(request.function_code, code) if code else self._answer(request)
        answer.dev_id, answer.transaction_id = request.dev_id, request.transaction_id
        if faults.once("wrong"):
            answer.transaction_id = (request.transaction_id + 7) % 0xFFFF + 1
        frame = self._framer.buildFrame(answer)
        if faults.once("garbage"):
            frame = bytes(byte ^ 0xA5 for byte in frame)
        if faults.delay_s > 0.0:
            await asyncio.sleep(faults.delay_s)
        writer.write(frame)

    def _answer(self, request: ModbusPDU) -> ModbusPDU:
        function, address, now_s = request.function_code, request.address, time.monotonic()
        if function == 3:
            registers = self._terminal.read(address, request.count)
            if registers is not None:
                return ReadHoldingRegistersResponse(registers=registers)
        elif function in (6, 16):
            values = list(request.registers)
            if self._terminal.write(address, values, now_s):
                if function == 6:
                    return WriteSingleRegisterResponse(address=address, registers=values)
                return WriteMultipleRegistersResponse(address=address, count=len(values))
        else:
            return ExceptionResponse(function, _ILLEGAL_FUNCTION)
        return ExceptionResponse(function, _ILLEGAL_ADDRESS)


class ServedTerminal:
    """A terminal behind Modbus TCP on loopback while the context lasts, on a thread of its own.

    ``port`` 0 takes a free one; it is known once the context is entered.
    """

    def __init__(self, terminal: EmulatedTerminal, port: int = 0) -> None:
        self.port = port
        self._faults = TransportFaults()
        self._server = ModbusServer(terminal, self._faults)
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._begun = threading.Event()
        self._failure: Exception | None = None

    def inject(self, words: str) -> bool:
        """Break the transport; return whether ``words`` are a fault of it."""
        return self._faults.inject(words, time.monotonic())

    def __enter__(self) -> "ServedTerminal":
        """Listen; raises ConfigurationError where the port is taken, or is none."""
        self._thread.start()
        self._begun.wait()
        if self._failure is not None:
            self._thread.join()
            why = getattr(self._failure, "strerror", None) or str(self._failure)
            raise ConfigurationError(
                f"port {self.port}: cannot listen on {LOOPBACK} ({why}); choose another port from "
                "1 to 65535, or 0 for a free one"
            )
        return self

    def __exit__(self, *unused: object) -> None:
        """Break all connections and listen no more."""
        self._loop.call_soon_threadsafe(self._task.cancel)
        self._thread.join(5.0)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        ready: asyncio.Future[int] = self._loop.create_future()
        ready.add_done_callback(self._listens)
        self._task = self._loop.create_task(self._server.run(LOOPBACK, self.port, ready))
        try:
            self._loop.run_until_complete(self._task)
        except asyncio.CancelledError:
            pass
        except Exception as error:  # whatever it is, who entered the context is told
            self._failure = error
        finally:
            self._begun.set()
            for task in asyncio.all_tasks(self._loop):
                task.cancel()
            self._loop.run_until_complete(asyncio.sleep(0))
            self._loop.close()

    def _listens(self, ready: "asyncio.Future[int]") -> None:
        self.port = ready.result()
        self._begun.set()

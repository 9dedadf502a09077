"""Emulated Festo terminals on loopback for the tests: a server on a thread of its own."""

import asyncio
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.festo.terminal_watchdog import TerminalWatchdog
from pneuarm.hardware.festo_cpx.adapter import CpxSettings, FestoCpx
from pneuarm.hardware.festo_cpx.emulator import EmulatedCpx
from pneuarm.hardware.festo_cpx.protocol import COUNT_PA, CpxLayout
from pneuarm.hardware.festo_vtem.adapter import FestoVtem, VtemSettings
from pneuarm.hardware.festo_vtem.emulator import EmulatedVtem
from pneuarm.hardware.festo_vtem.protocol import VtemLayout
from pneuarm.hardware.transports.modbus_server import EmulatedTerminal, ModbusServer
from pneuarm.hardware.transports.transport_faults import TransportFaults
from tests.hardware.contract import Bench, Factory, RealClock

#: Longer than in a laboratory: a test machine may be busier than any robot's.
WATCHDOG = TerminalWatchdog(46100, 1, 400)
TIMEOUT_S = 0.5


class Served:
    """A terminal behind Modbus TCP while the context lasts; ``inject`` breaks its transport."""

    def __init__(self, terminal: EmulatedTerminal) -> None:
        self.faults = TransportFaults()
        self._server = ModbusServer(terminal, self.faults)
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run)
        self._ready = threading.Event()
        self.port = 0

    def inject(self, words: str) -> None:
        self.faults.inject(words, time.monotonic())

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        ready = self._loop.create_future()

        def listening(future: "asyncio.Future[int]") -> None:
            self.port = future.result()
            self._ready.set()

        ready.add_done_callback(listening)
        self._task = self._loop.create_task(self._server.run("127.0.0.1", 0, ready))
        with suppress(asyncio.CancelledError):
            self._loop.run_until_complete(self._task)
        for task in asyncio.all_tasks(self._loop):
            task.cancel()
        self._loop.run_until_complete(asyncio.sleep(0))
        self._loop.close()

    def __enter__(self) -> "Served":
        self._thread.start()
        assert self._ready.wait(5.0)
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._task.cancel)
        self._thread.join(5.0)


def cpx_settings(
    port: int, layout: CpxLayout, watchdog: TerminalWatchdog = WATCHDOG
) -> CpxSettings:
    return CpxSettings("127.0.0.1", port, 1, TIMEOUT_S, layout, watchdog)


def vtem_settings(port: int, layout: VtemLayout) -> VtemSettings:
    return VtemSettings("127.0.0.1", port, 1, TIMEOUT_S, 3.0, layout, WATCHDOG)


@contextmanager
def festo_cpx(arm: Arm) -> Iterator[Bench]:
    """A CPX terminal with a gap between its valves, wired backwards."""
    valves = tuple(range(arm.n_chambers, 0, -1))
    layout = CpxLayout((*valves[:-1], 6))
    emulated = EmulatedArm(arm, 0)
    with Served(EmulatedCpx(emulated, layout, WATCHDOG)) as served:
        hardware = FestoCpx(arm, cpx_settings(served.port, layout))
        yield _bench(arm, hardware, emulated, served)


@contextmanager
def festo_vtem(arm: Arm) -> Iterator[Bench]:
    """A VTEM with the chambers on its slots 1 and 2."""
    layout = VtemLayout(tuple(range(2, 2 + arm.n_chambers)))
    emulated = EmulatedArm(arm, 0)
    with Served(EmulatedVtem(emulated, layout, WATCHDOG)) as served:
        # A tenth of the real times: what is waited for is the terminal's state.
        hardware = FestoVtem(
            arm, vtem_settings(served.port, layout), lambda seconds: time.sleep(0.2 * seconds)
        )
        yield _bench(arm, hardware, emulated, served)


def _bench(
    arm: Arm, hardware: "FestoCpx | FestoVtem", emulated: EmulatedArm, served: Served
) -> Bench:
    def told_pa() -> Array:
        time.sleep(0.02)
        return emulated.setpoints_pa.copy()

    def plug() -> None:
        emulated.zero_all(time.monotonic(), "power")
        served.inject("clear")
        time.sleep(0.05)

    def unplug() -> None:
        served.inject("unplug 1000")
        time.sleep(0.05)

    return Bench(
        arm,
        hardware,
        told_pa,
        resolution_pa=COUNT_PA,
        unplug=unplug,
        plug=plug,
        abandon=hardware._terminal.close,
        watchdog_s=0.8,
        clock=RealClock(),
    )


#: Added to the contract's devices.
FESTO: dict[str, Factory] = {"festo-cpx": festo_cpx, "festo-vtem": festo_vtem}

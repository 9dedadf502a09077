"""Emulated Festo terminals on the bench: patient, for a busy machine, and wired across."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.festo.counts import COUNT_PA
from pneuarm.hardware.festo.terminal_watchdog import TerminalWatchdog
from pneuarm.hardware.festo_cpx.adapter import CpxSettings, FestoCpx
from pneuarm.hardware.festo_cpx.emulator import EmulatedCpx
from pneuarm.hardware.festo_cpx.protocol import CpxLayout
from pneuarm.hardware.festo_vtem.adapter import FestoVtem, VtemSettings
from pneuarm.hardware.festo_vtem.emulator import EmulatedVtem
from pneuarm.hardware.festo_vtem.protocol import VtemLayout
from pneuarm.hardware.transports.modbus_server import ServedTerminal
from pneuarm.service.devices.contract import Bench, RealClock

#: Longer than in a laboratory: a test machine may be busier than any robot's.
WATCHDOG = TerminalWatchdog(46100, 1, 400)
TIMEOUT_S = 0.5


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
    with ServedTerminal(EmulatedCpx(emulated, layout, WATCHDOG)) as served:
        hardware = FestoCpx(arm, cpx_settings(served.port, layout))
        yield _bench(arm, hardware, emulated, served)


@contextmanager
def festo_vtem(arm: Arm) -> Iterator[Bench]:
    """A VTEM with the chambers on its slots 1 and 2."""
    layout = VtemLayout(tuple(range(2, 2 + arm.n_chambers)))
    emulated = EmulatedArm(arm, 0)
    with ServedTerminal(EmulatedVtem(emulated, layout, WATCHDOG)) as served:
        # A tenth of the real times: what is waited for is the terminal's state.
        hardware = FestoVtem(
            arm, vtem_settings(served.port, layout), lambda seconds: time.sleep(0.2 * seconds)
        )
        yield _bench(arm, hardware, emulated, served)


def _bench(
    arm: Arm, hardware: "FestoCpx | FestoVtem", emulated: EmulatedArm, served: ServedTerminal
) -> Bench:
    def told_pa() -> Array:
        time.sleep(0.02)
        return emulated.setpoints_pa.copy()

    def plug() -> None:
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

"""Emulated Festo terminals: CPX and VTEM behind Modbus TCP on loopback."""

import argparse
import asyncio
import signal
import time
from dataclasses import replace

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.festo.terminal_watchdog import TerminalWatchdog
from pneuarm.hardware.festo_cpx.emulator import EmulatedCpx
from pneuarm.hardware.festo_vtem.emulator import EmulatedVtem
from pneuarm.hardware.transports.modbus_server import EmulatedTerminal, ModbusServer
from pneuarm.hardware.transports.transport_faults import ALL_WORDS, TransportFaults, start_console
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.configuration.tables.festo import FestoConfig
from pneuarm.service.devices import festo
from pneuarm.service.emulators.command import emulated_arm
from pneuarm.service.processes import realtime

_HOST = "127.0.0.1"


def cpx(arguments: argparse.Namespace, configuration: Configuration) -> int:
    """Emulate a CPX terminal."""
    table, arm = configuration.festo_cpx, configuration.build_arm()
    emulated = emulated_arm(arguments, configuration)
    where = festo.cpx_layout(table, arm)
    hold = arguments.fail_safe == "hold"
    terminal = EmulatedCpx(emulated, where, _watchdog(arguments, table), hold)
    return _serve("festo-cpx", arguments, configuration, terminal, emulated)


def vtem(arguments: argparse.Namespace, configuration: Configuration) -> int:
    """Emulate a VTEM."""
    table, arm = configuration.festo_vtem, configuration.build_arm()
    emulated = emulated_arm(arguments, configuration)
    where = festo.vtem_layout(table, arm)
    hold = arguments.fail_safe == "hold"
    terminal = EmulatedVtem(emulated, where, _watchdog(arguments, table), hold)
    return _serve("festo-vtem", arguments, configuration, terminal, emulated)


def _watchdog(arguments: argparse.Namespace, table: FestoConfig) -> TerminalWatchdog:
    where = festo.watchdog(table)
    if arguments.watchdog_ms is None:
        return where
    return replace(where, timeout_ms=arguments.watchdog_ms)


def _serve(
    name: str,
    arguments: argparse.Namespace,
    configuration: Configuration,
    terminal: EmulatedTerminal,
    arm: EmulatedArm,
) -> int:
    realtime.take_priority(1)  # a real terminal is not kept waiting by what this machine does
    faults = TransportFaults()
    with asyncio.Runner() as runner:
        try:
            runner.run(
                _run(name, arguments, configuration, ModbusServer(terminal, faults), (arm, faults))
            )
        except asyncio.CancelledError:
            pass
        except OSError as error:
            raise ConfigurationError(
                f"--port {arguments.port}: cannot listen on {_HOST} ({error.strerror}); choose "
                "another port, or 0 for a free one"
            ) from error
    return 0


async def _run(
    name: str,
    arguments: argparse.Namespace,
    configuration: Configuration,
    server: ModbusServer,
    parts: tuple[EmulatedArm, TransportFaults],
) -> None:
    loop = asyncio.get_running_loop()
    ready: asyncio.Future[int] = loop.create_future()
    task = loop.create_task(server.run(_HOST, arguments.port, ready))
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, task.cancel)
    await asyncio.wait((task, ready), return_when=asyncio.FIRST_COMPLETED)
    if ready.done():
        arm, faults = parts
        print(_configuration_lines(name, configuration, ready.result()), flush=True)
        start_console(arm.inject, faults, time.monotonic)
    await task


def _configuration_lines(name: str, configuration: Configuration, port: int) -> str:
    """Return the lines that make a daemon use this emulator, as they stand."""
    table = name.replace("-", "_")
    vacuum = any(section.pressure_min_bar < 0.0 for section in configuration.arm.sections)
    largest = max(section.pressure_max_bar for section in configuration.arm.sections)
    lines = [
        f"# {name} with the arm {configuration.arm.name}; use it with these lines:",
        f'preset = "{configuration.preset}"',
        "[hardware]",
        f'adapter = "{name}"',
        f"[{table}]",
        f'host = "{_HOST}"',
        f"port = {port}",
    ]
    if vacuum:
        lines.append('valve_range = "vacuum"')
    if largest > 1.2:
        lines.append(f"ceiling_bar = {largest:g}")
    lines.append(f"# faults, a line each on stdin: {', '.join(ALL_WORDS)}")
    return "\n".join(lines)

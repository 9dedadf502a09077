"""Emulated serial controllers: Ctrl-P and ESP32 on a pseudo-terminal."""

import argparse
import signal
import threading
import time

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.channels import Channels
from pneuarm.hardware.ctrl_p.emulator import CtrlPEmulator
from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.emulation.faults import PHYSICAL_WORDS
from pneuarm.hardware.esp32.emulator import Esp32Emulator
from pneuarm.hardware.esp32.protocol import CHAMBERS
from pneuarm.hardware.transports.pseudo_terminal import PseudoTerminal, SerialEmulator
from pneuarm.hardware.transports.serial_faults import SERIAL_WORDS, SerialFaults
from pneuarm.hardware.transports.transport_faults import start_console
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.devices import serial_devices
from pneuarm.service.emulators.command import emulated_arm


def ctrl_p(arguments: argparse.Namespace, configuration: Configuration) -> int:
    """Emulate a Ctrl-P controller."""
    table, arm = configuration.ctrl_p, configuration.build_arm()
    valves = serial_devices.valves(table, arm)
    channels = Channels(arm, table.channels, valves, "[ctrl_p] valves")
    emulated = emulated_arm(arguments, configuration)
    lines = [f"channels = {table.channels}", f"valves = {list(valves)}"]
    lines.append(f"ceiling_bar = {_ceiling_bar(configuration):g}")
    return _serve("ctrl-p", configuration, CtrlPEmulator(emulated, channels), emulated, lines)


def esp32(arguments: argparse.Namespace, configuration: Configuration) -> int:
    """Emulate an ESP32 controller; its potentiometers stand in two rows of three."""
    table, arm = configuration.esp32, configuration.build_arm()
    if arm.n_chambers != CHAMBERS:
        raise ConfigurationError(
            f"--arm: the ESP32 controller has {CHAMBERS} chambers, and arm {arm.name!r} has "
            f"{arm.n_chambers}"
        )
    valves = serial_devices.valves(table, arm)
    channels = Channels(arm, CHAMBERS, valves, "[esp32] valves")
    emulated = emulated_arm(arguments, configuration)
    rows = [[valve + 1, valve + 1 + CHAMBERS] for valve in valves]
    lines = [f"valves = {list(valves)}", f"potentiometers = {rows}"]
    return _serve("esp32", configuration, Esp32Emulator(emulated, channels), emulated, lines)


def _ceiling_bar(configuration: Configuration) -> float:
    """Return the configured ceiling, or one that the arm's largest pressure stays below."""
    largest = max(section.pressure_max_bar for section in configuration.arm.sections)
    return max(configuration.ctrl_p.ceiling_bar, 1.25 * largest)


def _serve(
    name: str,
    configuration: Configuration,
    emulator: SerialEmulator,
    arm: EmulatedArm,
    lines: list[str],
) -> int:
    """Be the device until SIGINT or SIGTERM."""
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    terminal = PseudoTerminal(emulator, SerialFaults())

    def inject(words: str) -> None:
        with terminal.lock:
            arm.inject(words)

    with terminal:
        print(_configuration_lines(name, configuration, terminal, lines), flush=True)
        start_console(inject, terminal.faults, time.monotonic)
        ended.wait()
    return 0


def _configuration_lines(
    name: str, configuration: Configuration, terminal: PseudoTerminal, lines: list[str]
) -> str:
    """Return the lines that make a daemon use this emulator, as they stand."""
    head = [
        f"# {name} with the arm {configuration.arm.name}; use it with these lines:",
        f'preset = "{configuration.preset}"',
        "[hardware]",
        f'adapter = "{name}"',
        "accept_no_watchdog = true",
        f"[{name.replace('-', '_')}]",
        f'device = "{terminal.path}"',
    ]
    words = ", ".join((*SERIAL_WORDS, *PHYSICAL_WORDS))
    return "\n".join([*head, *lines, f"# faults, a line each on stdin: {words}"])

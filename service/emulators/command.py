"""`pneuarm emulate`: a device without the device, behind its real transport."""

import argparse
import json
import os
import signal
import threading
from collections.abc import Mapping
from pathlib import Path

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.hardware.device import EmulatedDevice
from pneuarm.hardware.emulation.emulation import DeviceRecord, EmulatedArm
from pneuarm.hardware.simulator.parameters import NOMINAL
from pneuarm.hardware.transports.transport_faults import start_console
from pneuarm.service.configuration.configuration import PRESETS, Configuration, load
from pneuarm.service.configuration.devices import AnyDevice, devices
from pneuarm.service.processes import realtime

#: Begins the line after the last line of configuration.
LAST_LINE = "# faults"


def emulate(arguments: argparse.Namespace) -> int:
    """Run one emulator until Ctrl-C or SIGTERM; faults are lines on stdin."""
    device = devices().named(arguments.what)
    if not isinstance(device, EmulatedDevice):
        raise InvalidInput(f"device {device.name!r} has no emulator")
    configuration = configuration_of(arguments.arm)
    config, arm = configuration.of_device(device), configuration.build_arm()
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    realtime.take_priority(1)  # a real device is not kept waiting by what this machine does
    emulated = _emulated_arm(arguments, configuration)
    with device.emulate(config, arm, emulated, arguments) as emulation:
        print("\n".join(_lines(device, configuration, emulation.table)))
        print(f"{LAST_LINE}, a line each on stdin: {', '.join(emulation.words)}", flush=True)
        start_console(emulation.inject, emulation.words)
        ended.wait()
    return 0


def _emulated_arm(arguments: argparse.Namespace, configuration: Configuration) -> EmulatedArm:
    """Make the arm behind an emulator; raises InvalidInput where its record cannot be kept."""
    if arguments.record is not None and not _may_be_file(arguments.record):
        raise InvalidInput(f"--record {arguments.record}: it is a folder, a pipe or a device")
    try:
        record = None if arguments.record is None else DeviceRecord(arguments.record)
    except OSError as error:
        raise InvalidInput(f"--record {arguments.record}: {error.strerror}") from error
    nominal = NOMINAL[arguments.valves or configuration.simulated.valves]
    return EmulatedArm(configuration.build_simulated_arm(), arguments.seed, record, nominal)


def _may_be_file(path: Path) -> bool:
    return not os.path.lexists(path) or os.path.isfile(path)


def _lines(
    device: AnyDevice, configuration: Configuration, table: Mapping[str, object]
) -> list[str]:
    """Return the lines that make a daemon use this emulator, as they stand."""
    lines = [
        f"# {device.name} with the arm {configuration.arm.name}; use it with these lines:",
        f'preset = "{configuration.preset}"',
        "[hardware]",
        f'adapter = "{device.name}"',
    ]
    if device.left_behind(configuration.of_device(device)):
        lines.append("accept_no_watchdog = true")
    # Texts, numbers and lists of them are the same in TOML as in JSON.
    keys = [f"{key} = {json.dumps(value)}" for key, value in table.items()]
    return [*lines, f"[{device.table}]", *keys]


def configuration_of(arm: str) -> Configuration:
    """Load a built-in arm, or a configuration file."""
    if arm in PRESETS:
        return load(None, arm)
    if not Path(arm).is_file():
        raise InvalidInput(
            f"--arm {arm!r}: no such file, nor a built-in arm; allowed: {', '.join(PRESETS)}"
        )
    return load(Path(arm))

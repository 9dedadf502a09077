"""`pneuarm emulate`: a device without the device, behind its real transport."""

import argparse
import importlib
from collections.abc import Callable
from pathlib import Path

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.hardware.emulation.emulation import DeviceRecord, EmulatedArm
from pneuarm.service.configuration.configuration import PRESETS, Configuration, load

#: What can be emulated -> "module:function" of ``(arguments, configuration) -> exit status``.
EMULATORS = {
    "festo-cpx": "pneuarm.service.emulators.festo:cpx",
    "festo-vtem": "pneuarm.service.emulators.festo:vtem",
    "ctrl-p": "pneuarm.service.emulators.serial:ctrl_p",
    "esp32": "pneuarm.service.emulators.serial:esp32",
}

Emulator = Callable[[argparse.Namespace, Configuration], int]


def emulate(arguments: argparse.Namespace) -> int:
    """Run one emulator until Ctrl-C or SIGTERM; faults are lines on stdin."""
    module, _, function = EMULATORS[arguments.what].partition(":")
    emulator: Emulator = getattr(importlib.import_module(module), function)
    return emulator(arguments, configuration_of(arguments.arm))


def emulated_arm(arguments: argparse.Namespace, configuration: Configuration) -> EmulatedArm:
    """Make the arm behind an emulator; raises InvalidInput where its record cannot be kept."""
    try:
        record = None if arguments.record is None else DeviceRecord(arguments.record)
    except OSError as error:
        raise InvalidInput(f"--record {arguments.record}: {error.strerror}") from error
    return EmulatedArm(configuration.build_simulated_arm(), arguments.seed, record)


def configuration_of(arm: str) -> Configuration:
    """Load a built-in arm, or a configuration file."""
    if arm in PRESETS:
        return load(None, arm)
    if not Path(arm).is_file():
        raise InvalidInput(
            f"--arm {arm!r}: no such file, nor a built-in arm; allowed: {', '.join(PRESETS)}"
        )
    return load(Path(arm))

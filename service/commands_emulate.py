"""`pneuarm emulate`: a device without the device, behind its real transport."""

import argparse
import importlib
from collections.abc import Callable
from pathlib import Path

from controllers.errors import InvalidInput
from hardware.emulation import DeviceRecord, EmulatedArm
from service.config import PRESETS, Configuration, load

#: What can be emulated -> "module:function" of ``(arguments, configuration) -> exit status``.
EMULATORS = {
    "festo-cpx": "service.emulate_festo:cpx",
    "festo-vtem": "service.emulate_festo:vtem",
    "ctrl-p": "service.emulate_serial:ctrl_p",
    "esp32": "service.emulate_serial:esp32",
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

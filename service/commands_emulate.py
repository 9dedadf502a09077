"""`pneuarm emulate`: a device without the device, behind its real transport."""

import argparse
import importlib
from collections.abc import Callable
from pathlib import Path

from controllers.errors import InvalidInput
from service.config import PRESETS, Configuration, load

#: What can be emulated -> "module:function" of ``(arguments, configuration) -> exit status``.
EMULATORS = {
    "festo-cpx": "service.emulate_festo:cpx",
    "festo-vtem": "service.emulate_festo:vtem",
}

Emulator = Callable[[argparse.Namespace, Configuration], int]


def emulate(arguments: argparse.Namespace) -> int:
    """Run one emulator until Ctrl-C or SIGTERM; faults are lines on stdin."""
    module, _, function = EMULATORS[arguments.what].partition(":")
    emulator: Emulator = getattr(importlib.import_module(module), function)
    return emulator(arguments, configuration_of(arguments.arm))


def configuration_of(arm: str) -> Configuration:
    """Load a built-in arm, or a configuration file."""
    if arm in PRESETS:
        return load(None, arm)
    if not Path(arm).is_file():
        raise InvalidInput(
            f"--arm {arm!r}: no such file, nor a built-in arm; allowed: {', '.join(PRESETS)}"
        )
    return load(Path(arm))

"""The kinds of device that a configuration may name: ours, and those of other packages.

A folder under `hardware/` or `logs/` with a `device.py` is a device: its object is `DEVICE`. Other
packages register theirs by the entry point group `pneuarm.devices`. One of these that cannot be
used is kept with the reason; every other device can be used all the same.
"""

import importlib
import importlib.util
import pkgutil
import re
from collections.abc import Iterator, Set
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from pydantic import ValidationError

import pneuarm.hardware
import pneuarm.logs
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.device import Device, EmulatedDevice
from pneuarm.hardware.simulator.device import SimulatedDevice
from pneuarm.hardware.tables.table import Table

GROUP = "pneuarm.devices"
#: `pneuarm emulate camera` is no device.
_CAMERA = "camera"

AnyDevice = Device[Any]


@dataclass(frozen=True)
class BrokenDevice:
    """A device of another package that cannot be used; ``reason`` is one sentence."""

    name: str
    package: str
    reason: str

    def __str__(self) -> str:
        """Say whose it is, and what is wrong with it."""
        return f"device {self.name!r} of package {self.package} cannot be used: {self.reason}"


@dataclass(frozen=True)
class Devices:
    """All kinds of device that are installed, by name, and those that are broken."""

    usable: dict[str, AnyDevice]
    broken: dict[str, BrokenDevice]

    def named(self, name: str) -> AnyDevice:
        """Return a device; raises ConfigurationError with the reason, or with what is allowed."""
        if name in self.usable:
            return self.usable[name]
        if name in self.broken:
            raise ConfigurationError(str(self.broken[name]))
        raise ConfigurationError(f"no device is called {name!r}; allowed: {', '.join(self.usable)}")

    def set_aside(self, taken: Set[str]) -> None:
        """Count those of other packages as broken whose table has a name that is ``taken``."""
        for name, device in list(self.usable.items()):
            if device.table in taken:
                package = type(device).__module__.partition(".")[0]
                reason = f"[{device.table}] is taken by pneuarm itself: choose another name"
                self.broken[name] = BrokenDevice(name, package, reason)
                del self.usable[name]


@cache
def devices() -> Devices:
    """Return the kinds of device of this installation."""
    usable = {device.name: device for device in _own()}
    broken: dict[str, BrokenDevice] = {}
    for point in entry_points(group=GROUP):
        try:
            device = _checked(point.load(), point, usable)
        # Whatever is wrong in another package must not keep this arm from being used.
        except (Exception, SystemExit) as error:
            broken[point.name] = BrokenDevice(point.name, _package(point), _one_line(error))
        else:
            usable[device.name] = device
    return Devices(dict(sorted(usable.items())), broken)


def emulated_devices() -> list[EmulatedDevice[Any]]:
    """Return those that can be emulated."""
    return [device for device in devices().usable.values() if isinstance(device, EmulatedDevice)]


def shown_devices() -> list[AnyDevice]:
    """Return those that a demo can show: simulated, or emulated."""
    kinds = (SimulatedDevice, EmulatedDevice)
    return [device for device in devices().usable.values() if isinstance(device, kinds)]


def _own() -> Iterator[AnyDevice]:
    """Find the devices of this package."""
    for home in (pneuarm.hardware, pneuarm.logs):
        for folder in pkgutil.iter_modules(home.__path__, f"{home.__name__}."):
            if folder.ispkg and importlib.util.find_spec(f"{folder.name}.device"):
                yield importlib.import_module(f"{folder.name}.device").DEVICE


def _checked(found: object, point: EntryPoint, others: dict[str, AnyDevice]) -> AnyDevice:
    """Return what an entry point names, if it is a device that can stand beside the others."""
    if not isinstance(found, Device):
        raise TypeError(f"{point.value} is no object of a class made of pneuarm.hardware.device")
    if not re.fullmatch("[a-z][a-z0-9]*(-[a-z0-9]+)*", point.name) or point.name == _CAMERA:
        raise ValueError("its name must be words in small letters with - between, no 'camera'")
    if found.name != point.name:
        raise ValueError(f"{point.value} calls itself {found.name!r}: both names must be the same")
    if found.table in {other.table for other in others.values()}:
        raise ValueError("another device has this name")
    if not (isinstance(found.config, type) and issubclass(found.config, Table)):
        raise TypeError(f"its config {found.config!r} is no class made of pneuarm's Table")
    if not isinstance(found.summary, str):
        raise TypeError(f"its summary {found.summary!r} is no text")
    try:
        found.config()
    except ValidationError as error:
        keys = ", ".join(str(item["loc"][0]) for item in error.errors() if item["loc"])
        raise ValueError(f"every key of its table needs a default, {keys} too") from error
    return found


def _package(point: EntryPoint) -> str:
    return point.dist.name if point.dist is not None else point.module


def _one_line(error: BaseException) -> str:
    """Return an error as one line: of a foreign package, so with the kind that it is."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:300]

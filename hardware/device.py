"""A kind of device as everything but its adapter sees it: one object in the device's folder.

The daemon, `doctor`, `emulate` and the unit file ask these objects and know no device by its name.
They are made in every process: a device's own libraries are imported where they are used.
"""

import math
import os
import socket
from abc import ABC, abstractmethod
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Generic, TypeVar

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.tables.table import Table

if TYPE_CHECKING:
    from pneuarm.hardware.emulation.emulation import EmulatedArm
    from pneuarm.hardware.interface import Hardware

Config = TypeVar("Config", bound=Table)

#: Of a device without a watchdog that says nothing more exact.
KEEPS_ITS_PRESSURES = "without a watchdog it keeps the last pressures when this machine dies"


@dataclass(frozen=True)
class SerialPort:
    """A device on a serial line, such as ``/dev/serial/by-id/...``."""

    path: str

    @property
    def lock(self) -> str:
        """The port, by whatever link it is called."""
        return f"serial:{os.path.realpath(self.path)}"


@dataclass(frozen=True)
class TcpPort:
    """A device on the network."""

    host: str
    port: int

    @property
    def lock(self) -> str:
        """The address, by whatever name it is called."""
        host = self.host
        with suppress(OSError, UnicodeError):
            host = socket.gethostbyname(host)
        return f"tcp/{host}:{self.port}"


@dataclass(frozen=True)
class Bus:
    """A device on something else that only one program may talk to, such as ``can0/12``."""

    name: str

    @property
    def lock(self) -> str:
        """The name as it is."""
        return f"bus:{self.name}"


@dataclass(frozen=True)
class InMemory:
    """A device that is made anew by each daemon; ``hardware.device`` names it, or the arm does."""


Address = SerialPort | TcpPort | Bus | InMemory


class Device(ABC, Generic[Config]):
    """One kind of device. ``build``, ``address`` and ``left_behind`` must be there."""

    #: As in `[hardware] adapter`; its table of the configuration has ``_`` for every ``-``.
    name: ClassVar[str]
    #: In a few words, for the command line and the documents.
    summary: ClassVar[str]
    #: Its table of the configuration. Every key has a default: a table that is not used is empty.
    config: type[Config]

    #: True where no call of the adapter ever waits: it then runs inside of control.
    never_waits: ClassVar[bool] = False
    #: Keys of `[[arm.sections]]` that an arm needs so that this device can move it; for the demo.
    demo_section: ClassVar[Mapping[str, float]] = {}

    @property
    def table(self) -> str:
        """Name of its table in the configuration."""
        return self.name.replace("-", "_")

    def require(self) -> None:
        """Raise NotInstalled where a package is missing that only this device needs."""

    @abstractmethod
    def build(self, config: Config, arm: Arm) -> "Hardware":
        """Make the adapter; touches no device.

        Raises ConfigurationError where a key is missing or the wiring does not fit the arm.
        """

    @abstractmethod
    def address(self, config: Config) -> Address:
        """Return where the device is: one daemon a device, and where `doctor` looks for it."""

    @abstractmethod
    def left_behind(self, config: Config) -> str:
        """Say what stays in the arm when this machine dies.

        Empty only where the device zeroes its outputs by itself when its host falls silent.
        """

    def watchdog_s(self, config: Config) -> float:
        """Return after how long a silence of its host the device zeroes its outputs by itself.

        Infinite where it does not, or where nobody knows. After half of it without an exchange
        the device counts as lost.
        """
        return math.inf


class EmulatedDevice(Device[Config]):
    """A device that can be emulated on its real transport, for `pneuarm emulate` and the demo."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add what only this emulator takes on the command line."""

    @abstractmethod
    def emulate(
        self, config: Config, arm: Arm, emulated: "EmulatedArm", options: Namespace
    ) -> "AbstractContextManager[Emulation]":
        """Return a context in which the device is there, on loopback, and ``emulated`` behind it.

        ``arm`` is the arm that is wired to it, ``options`` holds what ``add_arguments`` asks for.
        """


@dataclass(frozen=True)
class Emulation:
    """An emulated device that is running."""

    #: Keys of the device's table, besides those that it was given, that make a daemon use it.
    table: Mapping[str, object]
    #: Takes a fault, one of ``words``; raises InvalidInput for another one.
    inject: Callable[[str], None]
    words: tuple[str, ...]

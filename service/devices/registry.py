"""The configured device: built, checked against the arm, and where its lock is."""

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.device import Address, InMemory
from pneuarm.hardware.interface import Hardware
from pneuarm.service.configuration.configuration import Configuration, load
from pneuarm.service.configuration.configuration import check as check_tables
from pneuarm.service.configuration.devices import AnyDevice, devices


def build(configuration: Configuration, arm: Arm) -> Hardware:
    """Make the device that the configuration names; it is not connected yet.

    Raises ConfigurationError where it cannot be wired to the arm as configured, and NotInstalled
    where a package is missing that it needs.
    """
    device = configuration.device
    device.require()
    return device.build(configuration.of_device(device), arm)


def check(configuration: Configuration) -> None:
    """Raise ConfigurationError or NotInstalled where a device may not be started; touches none."""
    configuration.device.require()
    if not in_control(configuration):
        build(configuration, configuration.build_arm())
    left_behind = _left_behind(configuration)
    if left_behind and not configuration.hardware.accept_no_watchdog:
        raise ConfigurationError(
            f"hardware.adapter = {configuration.device.name!r}: {left_behind}; set "
            "hardware.accept_no_watchdog = true if a hand is always on the air supply"
        )


def _left_behind(configuration: Configuration) -> str:
    device = configuration.device
    return device.left_behind(configuration.of_device(device))


def in_control(configuration: Configuration) -> bool:
    """Whether the device runs inside of control, for it never waits."""
    return configuration.device.never_waits


def warnings(configuration: Configuration) -> list[str]:
    """Return what the start must say: what stays in the arm, which other devices are broken."""
    told = [_left_behind(configuration), *map(str, devices().broken.values())]
    return [text for text in told if text]


def location(configuration: Configuration) -> Address:
    """Return where the device is."""
    device = configuration.device
    return device.address(configuration.of_device(device))


def address(configuration: Configuration) -> str:
    """What the lock is on: one daemon a device, whatever the arm or the adapter is called."""
    where = location(configuration)
    if isinstance(where, InMemory):
        name = configuration.hardware.device or configuration.arm.name
        return f"{configuration.device.name}:{name}"
    return where.lock


def fitting(device: AnyDevice, preset: str) -> Configuration:
    """Return a built-in arm, or where the device cannot move it, one of its size that it can."""
    tables = load(preset=preset).model_dump(exclude_none=True)
    own = device.demo_section
    tables["arm"]["sections"] = [section | own for section in tables["arm"]["sections"]]
    return check_tables(tables, f"the arm for {device.name}")

"""Adapter's name -> device, loaded only when it is asked for."""

import os
import socket
from collections.abc import Callable
from contextlib import suppress

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.interface import Hardware
from pneuarm.service.configuration.configuration import Configuration

#: Adapters that never wait: they run inside of control. All others have a process of their own.
_IN_CONTROL = frozenset({"simulator"})


def _simulator(configuration: Configuration, arm: Arm) -> Hardware:
    from pneuarm.hardware.simulator.adapter import SimulatedArm
    from pneuarm.hardware.simulator.parameters import SimulatorParameters

    simulated = configuration.build_simulated_arm()
    return SimulatedArm(simulated, SimulatorParameters(), configuration.simulator.seed)


def _festo_cpx(configuration: Configuration, arm: Arm) -> Hardware:
    from pneuarm.service.devices.festo import cpx

    return cpx(configuration, arm)


def _festo_vtem(configuration: Configuration, arm: Arm) -> Hardware:
    from pneuarm.service.devices.festo import vtem

    return vtem(configuration, arm)


def _ctrl_p(configuration: Configuration, arm: Arm) -> Hardware:
    from pneuarm.service.devices.serial_devices import ctrl_p

    return ctrl_p(configuration, arm)


def _esp32(configuration: Configuration, arm: Arm) -> Hardware:
    from pneuarm.service.devices.serial_devices import esp32

    return esp32(configuration, arm)


def _replay(configuration: Configuration, arm: Arm) -> Hardware:
    from pneuarm.service.devices.serial_devices import replay

    return replay(configuration, arm)


_BUILDERS: dict[str, Callable[[Configuration, Arm], Hardware]] = {
    "simulator": _simulator,
    "festo-cpx": _festo_cpx,
    "festo-vtem": _festo_vtem,
    "ctrl-p": _ctrl_p,
    "esp32": _esp32,
    "replay": _replay,
}


def build(configuration: Configuration, arm: Arm) -> Hardware:
    """Make the device that the configuration names; it is not connected yet.

    Raises ConfigurationError where it cannot be wired to the arm as configured.
    """
    return _BUILDERS[configuration.hardware.adapter](configuration, arm)


def check(configuration: Configuration) -> None:
    """Raise ConfigurationError for a device that may not be started; touches none."""
    if configuration.hardware.adapter == "simulator":
        return
    device = build(configuration, configuration.build_arm())
    if not device.has_watchdog and not configuration.hardware.accept_no_watchdog:
        raise ConfigurationError(
            f"hardware.adapter = {configuration.hardware.adapter!r}: {_left_behind(device)}; set "
            "hardware.accept_no_watchdog = true if a hand is always on the air supply"
        )


def _left_behind(device: Hardware) -> str:
    """Say what a device without a watchdog leaves in the arm, in its own words where it has any."""
    usual = "without a watchdog it keeps the last pressures when this machine dies"
    return str(getattr(device, "left_behind", usual))


def in_control(configuration: Configuration) -> bool:
    """Whether the device runs inside of control, for it never waits."""
    return configuration.hardware.adapter in _IN_CONTROL


def warnings(configuration: Configuration) -> list[str]:
    """Return what the start must say about the device."""
    if in_control(configuration) or not configuration.hardware.accept_no_watchdog:
        return []
    device = build(configuration, configuration.build_arm())
    return [] if device.has_watchdog else [_left_behind(device)]


def address(configuration: Configuration) -> str:
    """What the lock is on: one daemon a device, whatever the arm or the adapter is called."""
    adapter = configuration.hardware.adapter
    terminals = {"festo-cpx": configuration.festo_cpx, "festo-vtem": configuration.festo_vtem}
    if adapter in terminals:
        terminal = terminals[adapter]
        host = terminal.host
        with suppress(OSError, UnicodeError):
            host = socket.gethostbyname(host)
        return f"tcp/{host}:{terminal.port}"
    ports = {"ctrl-p": configuration.ctrl_p.device, "esp32": configuration.esp32.device}
    if adapter in ports:  # by whatever link it is called
        return f"serial:{os.path.realpath(ports[adapter])}"
    return configuration.device_address


def drawn_parameters(configuration: Configuration, arm: Arm) -> dict[str, float]:
    """Every parameter that the simulator draws from its seed, to repeat the run."""
    if configuration.hardware.adapter != "simulator":
        return {}
    from pneuarm.hardware.simulator.parameters import SimulatorParameters, draw

    drawn = draw(SimulatorParameters(), configuration.simulator.seed, arm.n_sections).as_dict()
    del drawn["lowest_mode_hz"]  # follows from the others, and is known once the rod is built
    return drawn

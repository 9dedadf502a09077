"""Configuration of a serial device, or of a log in its place -> its adapter."""

import importlib
from pathlib import Path

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.ctrl_p.adapter import CtrlP, CtrlPSettings
from pneuarm.hardware.esp32.adapter import Esp32, Esp32Settings
from pneuarm.hardware.interface import Hardware
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.configuration.tables.serial import CtrlPConfig, Esp32Config
from pneuarm.service.configuration.tables.table import BAR


def ctrl_p(configuration: Configuration, arm: Arm) -> Hardware:
    """Make the adapter of a Ctrl-P controller; raises ConfigurationError for a wrong wiring."""
    table = configuration.ctrl_p
    settings = CtrlPSettings(
        device=_device("ctrl_p", table),
        valves=valves(table, arm),
        channels=table.channels,
        baud=table.baud,
        ceiling_pa=table.ceiling_bar * BAR,
        telemetry_s=table.telemetry_ms * 1e-3,
        timeout_s=table.timeout_ms * 1e-3,
        connect_timeout_s=table.connect_timeout_s,
    )
    return CtrlP(arm, settings)


def esp32(configuration: Configuration, arm: Arm) -> Hardware:
    """Make the adapter of an ESP32 controller; raises ConfigurationError for a wrong wiring."""
    table = configuration.esp32
    settings = Esp32Settings(
        device=_device("esp32", table),
        valves=valves(table, arm),
        potentiometers=table.potentiometers,
        baud=table.baud,
        ceiling_pa=table.ceiling_bar * BAR,
        timeout_s=table.timeout_ms * 1e-3,
        connect_timeout_s=table.connect_timeout_s,
    )
    return Esp32(arm, settings)


def replay(configuration: Configuration, arm: Arm) -> Hardware:
    """Put a log in the place of a device; raises ConfigurationError where none is named."""
    if not configuration.replay.log:
        raise ConfigurationError('replay.log is missing: the path of a recorded session, ".mcap"')
    # By name: control imports this module too, and must not be able to load the reader of logs.
    adapter = importlib.import_module("pneuarm.logs.reading.replay_device")
    device: Hardware = adapter.ReplayDevice(arm, Path(configuration.replay.log).expanduser())
    return device


def valves(table: CtrlPConfig | Esp32Config, arm: Arm) -> tuple[int, ...]:
    """Return the channel of every chamber."""
    return table.valves or tuple(range(arm.n_chambers))


def _device(name: str, table: CtrlPConfig | Esp32Config) -> str:
    if not table.device:
        raise ConfigurationError(
            f'{name}.device is missing: the path of its serial port, "/dev/serial/by-id/..."'
        )
    return table.device

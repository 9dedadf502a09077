"""Devices on a serial port: where they are, and which of their channels feeds which chamber."""

from typing import Annotated

from pydantic import Field

from pneuarm.service.configuration.tables.table import Positive, Table

DevicePath = Annotated[str, Field(max_length=255, pattern=r"^[\x20-\x7e]*$")]
Baud = Annotated[int, Field(ge=1200, le=4_000_000)]
ConnectTimeout = Annotated[float, Field(gt=0, le=60)]
Timeout = Annotated[float, Field(ge=100, le=5000)]


class CtrlPConfig(Table):
    """A Ctrl-P pressure controller. ``valves`` empty means 0, 1, 2, ... in chamber order."""

    device: DevicePath = ""
    baud: Baud = 115200
    channels: Annotated[int, Field(ge=3, le=64)] = 8
    valves: Annotated[
        tuple[Annotated[int, Field(ge=0, le=63)], ...], Field(max_length=48, strict=False)
    ] = ()
    ceiling_bar: Positive = 1.5
    telemetry_ms: Annotated[int, Field(ge=5, le=200)] = 20
    timeout_ms: Timeout = 500.0
    connect_timeout_s: ConnectTimeout = 3.0


class Esp32Config(Table):
    """An ESP32 controller of three chambers. ``potentiometers`` empty means no lengths."""

    device: DevicePath = ""
    baud: Baud = 115200
    valves: Annotated[
        tuple[Annotated[int, Field(ge=0, le=2)], ...], Field(max_length=3, strict=False)
    ] = ()
    potentiometers: Annotated[
        tuple[Annotated[tuple[Annotated[int, Field(ge=1, le=6)], ...], Field(strict=False)], ...],
        Field(max_length=3, strict=False),
    ] = ()
    ceiling_bar: Annotated[float, Field(gt=0, le=0.13)] = 0.13
    timeout_ms: Timeout = 500.0
    connect_timeout_s: ConnectTimeout = 8.0


class ReplayConfig(Table):
    """A recorded session in the place of a device."""

    log: str = ""

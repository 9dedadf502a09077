r"""Bytes <-> values of the Ctrl-P pressure controller, firmware and command set 2.3.

To it: ASCII, fields separated by ``;``, ended by ``\n``, in any case. From it: telemetry, fields
separated by tabs (``ms 0 setpoints...``, ``ms 1 measured...``, ``ms 2 supply``), and echoes, which
begin with ``_``. Pressures are in kPa here, which the host has to ask for. Source: the public
driver cbteeple/ctrlp, `ctrlp/command_spec/commands_2.3.yaml`, and its firmware.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

#: Smallest step of a setpoint: two decimals of a kilopascal, as the echo repeats it.
STEP_PA = 10.0
KPA = 1000.0
#: Telemetry beyond this is noise: no such controller is built for 100 bar.
LARGEST_KPA = 1e4

#: What the line of units says; a pressure in any other would be read as several times too high.
UNIT = "kpa"


class Mode(IntEnum):
    """What a channel does: its valve directly, or its pressure."""

    VALVE = 0
    PRESSURE = 1


class Kind(IntEnum):
    """What a line of telemetry holds."""

    SETPOINTS = 0
    MEASURED = 1
    SUPPLY = 2


@dataclass(frozen=True)
class Telemetry:
    """One line of telemetry: kPa gauge, NaN where the controller says so."""

    kind: Kind
    values_kpa: tuple[float, ...]


@dataclass(frozen=True)
class Echo:
    """The answer to a command: its name in capitals, its values, whether it changed something."""

    name: str
    values: tuple[str, ...]
    new: bool


def setpoints(pressures_pa: Sequence[float]) -> bytes:
    """Set all channels at once, without a ramp: with fewer values the first goes to all."""
    values = ";".join(f"{pressure / KPA:.2f}" for pressure in pressures_pa)
    return f"set;0;{values}\n".encode()


def vent(n_channels: int) -> tuple[bytes, ...]:
    """Empty all channels: zeros first, then every valve open to ambient.

    A valve is moved directly in mode 0 only, so that the mode comes last.
    """
    return setpoints([0.0] * n_channels), b"valve;-1\n", mode(Mode.VALVE)


def mode(value: Mode) -> bytes:
    """Set the mode of all channels."""
    return f"mode;{value:d}\n".encode()


def largest_pressure(pressure_pa: float) -> bytes:
    """Set the pressure of all channels above which the controller empties them by itself."""
    return f"maxp;{pressure_pa / KPA:.2f}\n".encode()


def smallest_pressure(pressure_pa: float) -> bytes:
    """Set the pressure of all channels below which no setpoint is taken."""
    return f"minp;{pressure_pa / KPA:.2f}\n".encode()


def telemetry_period(period_s: float) -> bytes:
    """Set the time between two sets of telemetry."""
    return f"time;{period_s * 1e3:.0f}\n".encode()


def ask(name: str) -> bytes:
    """Ask for the setting of a name in an echo, changing nothing."""
    return f"{name.lower()}\n".encode()


ASK_MODE = ask("MODE")
ECHO_ON = b"echo;1\n"
USE_KPA = b"units;1\n"
ALL_CHANNELS_ON = b"chan;1\n"
TELEMETRY_ON, TELEMETRY_OFF = b"on\n", b"off\n"


def parse(line: bytes) -> Telemetry | Echo | None:
    """Return what a line says, None where it is neither: half a line, or noise."""
    try:
        text = line.decode("ascii").strip()
    except UnicodeDecodeError:
        return None
    return _echo(text[1:]) if text.startswith("_") else _telemetry(text)


def _echo(text: str) -> Echo | None:
    name, colon, values = text.strip().partition(":")
    name = name.upper()
    new = name.startswith("NEW ")
    name = name.removeprefix("NEW ").strip()
    if not colon or not name.isalpha():
        return None
    return Echo(name, tuple(values.split()), new)


def _telemetry(text: str) -> Telemetry | None:
    try:
        time_ms, kind, *values = text.split("\t")
        numbers = tuple(float(value) for value in values)
        known = Kind(int(kind))
    except ValueError:
        return None
    if not time_ms.isdecimal() or any(abs(number) > LARGEST_KPA for number in numbers):
        return None
    return Telemetry(known, numbers) if numbers else None


def is_in_kpa(echo: Echo) -> bool:
    """Whether an echo of ``units`` says kilopascal for what is sent and for what is received."""
    return bool(echo.values) and all(value.lower() == UNIT for value in echo.values)


def modes(echo: Echo) -> tuple[int, ...] | None:
    """Return the modes of the channels from an echo of ``mode``, None where it is broken."""
    if not echo.values or not all(value in ("0", "1", "2", "3") for value in echo.values):
        return None
    return tuple(int(value) for value in echo.values)

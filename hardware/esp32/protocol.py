r"""Bytes <-> values of the ESP32 controller of three chambers.

One JSON object a line, both ways, at 115200 baud; pressures in kPa gauge, lengths in mm, angles in
degrees. Source: the public firmware luqmanroslan/soft-robotics-esp32-firmware.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

CHAMBERS = 3
POTENTIOMETERS = 6

#: Smallest step of a setpoint: two decimals of a kilopascal, as the confirmation repeats it.
STEP_PA = 10.0
KPA = 1000.0

#: The firmware takes no setpoint outside of this; it has no vacuum.
CEILING_PA = 13.0e3

#: One pass of the firmware. It reads one command a pass and forgets what came with it.
PASS_S = 0.02

#: Beyond these a value is noise: 10 bar, and ten times the longest chamber.
_LARGEST_KPA = 1000.0
_LARGEST_MM = 3000.0


@dataclass(frozen=True)
class Feedback:
    """One line of feedback, in its units; NaN where a value is missing or no number."""

    pressures_kpa: tuple[float, ...]
    targets_kpa: tuple[float, ...]
    potentiometers_mm: tuple[float, ...]
    imu_deg: tuple[float, ...]


@dataclass(frozen=True)
class Remark:
    """Anything else that the firmware says: a confirmation, its status, an error."""

    text: str
    is_error: bool


def set_pressures(pressures_pa: Sequence[float]) -> bytes:
    """Set the three pressures; also leaves the firmware's control of lengths."""
    values = [round(pressure / KPA, 2) for pressure in pressures_pa]
    return json.dumps({"command": "set_pressure", "values": values}).encode() + b"\n"


#: Lets the air out. The firmware's `emergency_stop` is not used: it closes the valves, and the air
#: stays in the chambers.
VENT = set_pressures([0.0] * CHAMBERS)


def parse(line: bytes) -> Feedback | Remark | None:
    """Return what a line says, None where it is half a line or noise."""
    try:
        said = json.loads(line)
    except (ValueError, RecursionError):  # UnicodeDecodeError and JSONDecodeError are ValueErrors
        return None
    if not isinstance(said, dict):
        return None
    if "pressure_1" in said:
        return _feedback(said)
    known = [key for key in ("error", "status", "confirm") if key in said]
    if not known:
        return None
    is_error = "error" in known or said.get("status") == "error"
    text = str(said.get("message", said[known[0]]) if is_error else said[known[0]])
    return Remark(text[:100], is_error)


def _feedback(said: dict[str, object]) -> Feedback | None:
    def numbers(name: str, count: int, largest: float) -> tuple[float, ...]:
        values = (_number(said.get(f"{name}_{index + 1}"), largest) for index in range(count))
        return tuple(values)

    pressures = numbers("pressure", CHAMBERS, _LARGEST_KPA)
    targets = numbers("target_pressure", CHAMBERS, _LARGEST_KPA)
    if not all(isfinite(value) for value in pressures + targets):
        return None
    lengths = numbers("potentiometer", POTENTIOMETERS, _LARGEST_MM)
    angles = tuple(_number(said.get(f"imu_{axis}"), 360.0) for axis in ("roll", "pitch", "yaw"))
    return Feedback(pressures, targets, lengths, angles)


def _number(value: object, largest: float) -> float:
    """Return a number, NaN for anything else and for one that cannot be."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return float("nan")
    return float(value) if abs(value) <= largest else float("nan")

"""What the fields of targets must satisfy, whatever the kind: there, finite, in unit and frame.

Everything here raises TargetRejected with one sentence: the field, its value and what is allowed.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import TargetRejected

#: The fields of a message by name: plain values, mappings for messages in it, None where left out.
Fields = Mapping[str, Any]

#: A position farther than this many arm lengths is not a position in metres.
FARTHEST_ARM_LENGTHS = 3.0

#: No soft arm moves its tip faster (m/s), or turns it faster (rad/s).
FASTEST_M_S = 5.0
FASTEST_RAD_S = 20.0

_UNIT_TOLERANCE = 1e-3

#: No radius, frequency or period of an arm is smaller or larger, whatever its unit.
_SMALLEST, _LARGEST = 1e-6, 1e6


class Allowed:
    """What one arm allows: where, how far, and how fast (m/s, m/s^2) a reference may move."""

    def __init__(
        self, arm: Arm, speed_m_s: float = math.inf, acceleration_m_s2: float = math.inf
    ) -> None:
        self.arm = arm
        self.speed_m_s, self.acceleration_m_s2 = speed_m_s, acceleration_m_s2
        self.farthest_m = FARTHEST_ARM_LENGTHS * arm.max_length_m
        self.lengths_m = length_bounds_m(arm)
        self.pressures_pa = arm.per_chamber("pressure_min_pa"), arm.per_chamber("pressure_max_pa")

    def position(self, fields: Fields, name: str = "position_m") -> Array:
        """Position (3,) in the base frame, near enough to be in metres."""
        required(fields, name)
        check_frame(fields, ("base",))
        return self.place(fields, name)

    def place(self, fields: Fields, name: str) -> Array:
        """Position (3,) of a message whose frame is told elsewhere."""
        position = vector(fields, name)
        self.check_near(position)
        return position

    def check_near(self, position_m: Array) -> None:
        """Refuse what is no position in metres."""
        distance = math.hypot(*position_m)
        if distance > self.farthest_m:
            raise TargetRejected(
                f"position_m = {listed(position_m)} is {distance:.3g} m from the base, more than "
                f"{FARTHEST_ARM_LENGTHS:g} arm lengths; is it in mm?"
            )

    def chambers(self, fields: Fields, name: str, unit: str, bounds: tuple[Array, Array]) -> Array:
        """A value a chamber (n_sections, 3) within its bounds."""
        values, (low, high) = fields[name], bounds
        if len(values) != self.arm.n_chambers:
            raise TargetRejected(
                f"{name} has {len(values)} values; arm {self.arm.name} has "
                f"{self.arm.n_chambers} chambers"
            )
        array = np.array(values, dtype=np.float64).reshape(low.shape)
        _check_finite(name, array)
        outside = (array < low) | (array > high)
        if outside.any():
            section, chamber = (int(index[0]) for index in np.nonzero(outside))
            raise TargetRejected(
                f"{name} of section {section + 1}, chamber {chamber + 1} is "
                f"{array[section, chamber]:.6g} {unit}; allowed: {low[section, chamber]:.6g} to "
                f"{high[section, chamber]:.6g} {unit}"
            )
        return array


def required(fields: Fields, name: str) -> Any:
    """Refuse a message that leaves a field out: protobuf would read it as zeros."""
    value = fields[name]
    if value is None:
        raise TargetRejected(f"{name} is missing")
    return value


def check_frame(fields: Fields, allowed: tuple[str, ...]) -> str:
    """Return the frame, one of those that are allowed."""
    frame: str = fields["frame_id"]
    if frame not in allowed:
        names = ", ".join(repr(name) for name in allowed)
        raise TargetRejected(f"frame_id = {frame!r}: unknown frame; allowed: {names}")
    return frame


def vector(fields: Fields, name: str) -> Array:
    """Vector (3,) of finite numbers."""
    value = required(fields, name)
    values = np.array([value[axis] for axis in "xyz"], dtype=np.float64)
    _check_finite(name, values)
    return values


def rate(fields: Fields, name: str, largest: float, unit: str, mistaken: str) -> Array:
    """Vector (3,) no longer than what any soft arm does; else it is in a mistaken unit."""
    values = vector(fields, name)
    if math.hypot(*values) > largest:
        raise TargetRejected(
            f"{name} = {listed(values)} is above {largest:g} {unit}; is it in {mistaken}?"
        )
    return values


def unit_vector(fields: Fields, name: str) -> Array:
    """Unit vector (3,) along a vector of some length."""
    values = vector(fields, name)
    norm = math.hypot(*values)
    if not 1e-6 < norm < 1e6:
        raise TargetRejected(f"{name} = {listed(values)} points nowhere; give a unit vector")
    return values / norm


def quaternion(fields: Fields, name: str) -> Array:
    """Unit quaternion ``(x, y, z, w)``."""
    value = required(fields, name)
    values = np.array([value[axis] for axis in "xyzw"], dtype=np.float64)
    _check_finite(name, values)
    norm = math.hypot(*values)
    if abs(norm - 1.0) > _UNIT_TOLERANCE:
        raise TargetRejected(
            f"{name} = {listed(values)} has the norm {norm:.4g}; a unit quaternion "
            "(x, y, z, w) is needed"
        )
    return values / norm


def positive(fields: Fields, name: str) -> float:
    """A number above 0, of a size that the powers and quotients of some are finite too."""
    value: float = fields[name]
    if not _SMALLEST <= value <= _LARGEST:
        raise TargetRejected(f"{name} = {value:g}; allowed: {_SMALLEST:g} to {_LARGEST:g}")
    return value


def times(fields: Fields, name: str) -> float:
    """How often; 0 is without end, and becomes infinity."""
    value: float = fields[name]
    if not 0.0 <= value < math.inf:
        raise TargetRejected(f"{name} = {value:g}: 0 (without end) or more")
    return value or math.inf


def listed(values: Array) -> str:
    """Numbers for a sentence."""
    return "[" + ", ".join(f"{value:.4g}" for value in values.reshape(-1)) + "]"


def _check_finite(name: str, values: Array) -> None:
    if not np.isfinite(values).all():
        raise TargetRejected(f"{name} = {listed(values)}: every value must be finite")

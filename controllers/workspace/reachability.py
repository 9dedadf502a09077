"""The answer to "can the tip be there?", the same for one section and for several."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pneuarm.controllers.actuation.pressure_map import length_bounds_m, pressure_length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths
from pneuarm.controllers.limits.bend import BendLimit
from pneuarm.controllers.limits.length import LengthLimit
from pneuarm.controllers.limits.pressure import PressureLimit

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Reachability:
    """Whether a position can be reached, and which point can where it cannot.

    ``limits`` are the bits of those that the arm touches at ``nearest_m`` (3,), the reachable point
    next to the position; 0, the position itself and ``distance_m`` 0 for one within reach.
    """

    reachable: bool
    limits: int
    nearest_m: Array
    distance_m: float


class LimitNames:
    """Says which limits some lengths ``(n_sections, 3)`` exceed or touch, as the controller does.

    A chamber at its end of travel counts as pressure where the pressure range ends before the
    interval of Eq. (4), else as length.
    """

    def __init__(self, arm: Arm) -> None:
        self.lower_m, self.upper_m = length_bounds_m(arm)
        self.bend_max_rad = arm.per_section("bend_max_rad")[:, 0]
        self.offset_m = arm.per_section("chamber_offset_m")
        low, high = pressure_length_bounds_m(arm)
        shortest, longest = arm.length_interval_m
        self._low_is_pressure, self._high_is_pressure = low > shortest, high < longest

    def within(self, lengths_m: Array, margin_m: float) -> int:
        """Limits of which less than ``margin_m`` is left; a negative margin means exceeded.

        The bend counts times the chamber offset, so that it is in metres too.
        """
        low = lengths_m - self.lower_m < margin_m
        high = self.upper_m - lengths_m < margin_m
        shapes = shapes_from_lengths(lengths_m, self.offset_m)
        bend_left = self.bend_max_rad - np.hypot(shapes[:, 1], shapes[:, 2])
        return self._named(low, high, bool((self.offset_m[:, 0] * bend_left < margin_m).any()))

    def _named(self, low: Flags, high: Flags, bend: bool) -> int:
        by_pressure = (low & self._low_is_pressure) | (high & self._high_is_pressure)
        flags = BendLimit.bit if bend else 0
        if by_pressure.any():
            flags |= PressureLimit.bit
        if ((low | high) & ~by_pressure).any():
            flags |= LengthLimit.bit
        return flags


def checked_positions(position_m: object, single: bool) -> Array:
    """Return positions ``(..., 3)`` as an array; ``(3,)`` only, if ``single``.

    Raises InvalidInput for a wrong shape and for a coordinate that is not finite.
    """
    try:
        positions = np.asarray(position_m, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"position_m = {position_m!r}: three numbers are needed") from error
    allowed = "(3,)" if single else "(..., 3)"
    if positions.shape[-1:] != (3,) or (single and positions.ndim != 1):
        raise InvalidInput(f"position_m has the shape {positions.shape}; allowed: {allowed}")
    finite = np.isfinite(positions).all(axis=-1)
    if not finite.all():
        index = tuple(int(i) for i in np.argwhere(~finite)[0])
        where = f"position_m{list(index) if index else ''}"
        raise InvalidInput(
            f"{where} = {positions[index].tolist()}: every coordinate must be finite"
        )
    return positions

"""Godage's shape functions: the pose as polynomials in the lengths of the chambers.

I. S. Godage, D. T. Branson, E. Guglielmino, G. A. Medrano-Cerda and D. G. Caldwell, "Shape
function-based kinematics and dynamics for variable length continuum robotic arms", IEEE ICRA,
2011, and I. S. Godage, G. A. Medrano-Cerda, D. T. Branson, E. Guglielmino and D. G. Caldwell,
"Modal kinematics for multisection continuum arms", Bioinspiration & Biomimetics 10(3), 2015:
every entry of the homogeneous transform is expanded into a Taylor series of the lengths around
the straight arm and cut off. Here the order counts the bending components u and v, which are
linear in the lengths; the arc length enters as a factor, exactly.

Where it fails: nowhere, the straight arm is where it is exact. Far from it the polynomial departs
from the arc, in the position and in that the "rotation" is none any more: with ``theta^k`` the
first power left out, the tip is wrong by about ``L theta^k / (k + 1)!``.
"""

from dataclasses import dataclass
from math import factorial

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths
from pneuarm.controllers.kinematics.models.model import chained, checked_lengths, transforms


def _series(theta_squared: Array, first: int, highest: int) -> Array:
    """Sum ``(-1)^k theta^(2k) / (2k + first)!`` with powers ``2k`` up to ``highest``."""
    total = np.zeros_like(theta_squared)
    for k in range(highest // 2, -1, -1):  # none if highest is negative: the sum is zero
        total = total * theta_squared + (-1.0) ** k / factorial(2 * k + first)
    return total


@dataclass(frozen=True)
class Godage:
    """The modal form of ``order`` in the bending components. Raises InvalidInput below 1."""

    order: int = 5

    def __post_init__(self) -> None:
        if not self.order >= 1:
            raise InvalidInput(f"order = {self.order}: the polynomial has order 1 or higher")

    @property
    def name(self) -> str:
        """With the order, which makes it another model."""
        return f"Godage, order {self.order}"

    def tip_transform(self, arm: Arm, lengths_m: Array) -> Array:
        """Transform (..., 4, 4) for lengths (..., n_sections, 3), m; never NaN.

        Raises InvalidInput for a wrong shape or a length that is no positive number.
        """
        lengths = checked_lengths(arm, lengths_m)
        shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))
        arc_length, u, v = np.moveaxis(shapes, -1, 0)
        square = u * u + v * v
        sine = _series(square, 1, self.order - 1)  # multiplied by u or v
        bow = _series(square, 2, self.order - 1)
        turn = _series(square, 2, self.order - 2)  # multiplied by two of u and v
        rotation = [
            [1.0 - u * u * turn, -u * v * turn, u * sine],
            [-u * v * turn, 1.0 - v * v * turn, v * sine],
            [-u * sine, -v * sine, 1.0 - square * turn],
        ]
        ahead = arc_length * _series(square, 1, self.order)
        return chained(transforms(rotation, [arc_length * u * bow, arc_length * v * bow, ahead]))

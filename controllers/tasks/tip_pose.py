"""The tip at a position and in an orientation."""

import math
from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.tasks.wanted import Wanted


def rotation_from_quaternion(quaternion_xyzw: Array) -> Array:
    """Rotation matrix (3, 3) of a unit quaternion ``(x, y, z, w)``."""
    x, y, z, w = quaternion_xyzw
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_from_rotation(rotation: Array) -> Array:
    """Unit quaternion ``(x, y, z, w)`` of a rotation matrix (3, 3), with ``w >= 0``."""
    (a, b, c), (d, e, f), (g, h, i) = rotation.tolist()  # plain floats: it runs in every tick
    squares = (1.0 + a - e - i, 1.0 - a + e - i, 1.0 - a - e + i, 1.0 + a + e + i)
    # Dividing by the largest of the four keeps full precision at every angle.
    rows = (
        (squares[0], b + d, c + g, h - f),
        (b + d, squares[1], f + h, c - g),
        (c + g, f + h, squares[2], d - b),
        (h - f, c - g, d - b, squares[3]),
    )
    row = rows[squares.index(max(squares))]
    x, y, z, w = row
    norm = math.copysign(math.sqrt(x * x + y * y + z * z + w * w), w)
    return np.array((x / norm, y / norm, z / norm, w / norm))


@dataclass(frozen=True)
class TipPose:
    """Bring the tip to a pose in the base frame: position (3,) and rotation (3, 3).

    An arm of one section has three degrees of freedom: where both cannot be had the result is
    the weighted compromise of the least squares; a radian weighs as much as ORIENTATION_LENGTH_M.
    """

    position_m: Array
    rotation: Array
    position_weight: float = 1.0
    orientation_weight: float = 1.0

    def write(self, wanted: Wanted) -> None:
        """Six rows."""
        wanted["position_m"], wanted["position_weight"] = self.position_m, self.position_weight
        wanted["rotation"], wanted["orientation_weight"] = self.rotation, self.orientation_weight
        wanted["position_follows"] = wanted["rotation_follows"] = 1.0
        wanted["posture_weight"] = 1.0

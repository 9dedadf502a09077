"""The tip at a position and in an orientation."""

import math
from dataclasses import dataclass

import numpy as np

from controllers.arm import Array
from controllers.kinematics.compiled import TipState
from controllers.tasks.task import limited

#: One radian of orientation error weighs as much as this many metres of position error.
ORIENTATION_LENGTH_M = 0.05


def rotation_vector(rotation: Array) -> Array:
    """Axis times angle (3,), rad, of a rotation matrix (3, 3); angles up to pi."""
    axial = 0.5 * np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    sine = float(np.sqrt(axial @ axial))
    cosine = 0.5 * (float(np.trace(rotation)) - 1.0)
    if sine > 1e-9:
        return axial * (math.atan2(sine, cosine) / sine)
    if cosine > 0.0:
        return axial
    # Half a turn: R = 2 a a^T - I, and either sign of the axis is right.
    column = np.argmax(np.diag(rotation))
    axis: Array = rotation[:, column] + np.eye(3)[column]
    return axis * (math.pi / float(np.linalg.norm(axis)))


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
    norm = math.copysign(math.sqrt(sum(value * value for value in row)), row[3])
    return np.array(row) / norm


@dataclass(frozen=True)
class TipPose:
    """Bring the tip to a pose in the base frame: position (3,) and rotation (3, 3).

    An arm of one section has three degrees of freedom: where both cannot be had the result is
    the weighted compromise of the least squares.
    """

    position_m: Array
    rotation: Array
    gain_per_s: float
    speed_max_m_s: float

    def _errors(self, tip: TipState) -> tuple[Array, Array]:
        turn = rotation_vector(self.rotation @ tip.rotation.T)
        return self.position_m - tip.position_m, ORIENTATION_LENGTH_M * turn

    def rate_and_jacobian(self, tip: TipState, lengths_m: Array) -> tuple[Array, Array]:
        """Six rows: position, then orientation scaled by ORIENTATION_LENGTH_M."""
        rate = limited(self.gain_per_s * np.concatenate(self._errors(tip)), self.speed_max_m_s)
        jacobian = np.vstack([tip.jacobian[:3], ORIENTATION_LENGTH_M * tip.jacobian[3:]])
        return rate, jacobian

    def error_m(self, tip: TipState, lengths_m: Array) -> float:
        """Norm of the position error and the scaled orientation error together."""
        return float(np.linalg.norm(np.concatenate(self._errors(tip))))

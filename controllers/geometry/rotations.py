"""Rotations as matrix, unit quaternion, rotation vector and angles, and from one to the other.

Plain arithmetic on single rotations, for the tick: the same to the last bit on every run, and
faster than a library of whole arrays. Off the tick SciPy's ``Rotation`` does it.
"""

import math

import casadi as ca
import numpy as np
from scipy.spatial.transform import Rotation

from pneuarm.controllers.arm.arm import Array

#: Sine of an angle (rad) below which the vector of a rotation needs no division.
_SMALL = 1e-9


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
    largest = max(squares)
    match squares.index(largest):
        case 0:
            x, y, z, w = largest, b + d, c + g, h - f
        case 1:
            x, y, z, w = b + d, largest, f + h, c - g
        case 2:
            x, y, z, w = c + g, f + h, largest, d - b
        case _:
            x, y, z, w = h - f, c - g, d - b, largest
    norm = math.copysign(math.sqrt(x * x + y * y + z * z + w * w), w)
    return np.array((x / norm, y / norm, z / norm, w / norm))


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
    if sine > _SMALL:
        return axial * (math.atan2(sine, cosine) / sine)
    if cosine > 0.0:
        return axial
    # Half a turn: R = 2 a a^T - I, and either sign of the axis is right.
    column = np.argmax(np.diag(rotation))
    axis: Array = rotation[:, column] + np.eye(3)[column]
    return axis * (math.pi / float(np.linalg.norm(axis)))


def rotation_from_vector(vector_rad: Array) -> Array:
    """Rotation (3, 3) about a vector (3,) by its length in rad (Rodrigues)."""
    angle = float(np.sqrt(vector_rad @ vector_rad))
    x, y, z = vector_rad.tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine = float(np.sinc(angle / np.pi))
    half = float(np.sinc(0.5 * angle / np.pi))
    rotation: Array = np.eye(3) + sine * cross + 0.5 * half * half * (cross @ cross)
    return rotation


def rotation_vectors(rotations: Array) -> Array:
    """Axis times angle ``(..., 3)``, rad, of rotations ``(..., 3, 3)``, the angle from 0 to pi."""
    flat = Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_rotvec()
    vectors: Array = flat.reshape(rotations.shape[:-1])
    return vectors


def roll_pitch_yaw(rotation: Array) -> tuple[float, float, float]:
    """Angles about the fixed x, then y, then z (rad) of a rotation (3, 3)."""
    return (
        math.atan2(rotation[2, 1], rotation[2, 2]),
        math.asin(min(max(-rotation[2, 0], -1.0), 1.0)),
        math.atan2(rotation[1, 0], rotation[0, 0]),
    )


def spin_of(turn: Array, rate: Array) -> Array:
    """Angular velocity (3,) of exp(turn) whose rotation vector changes at a rate (3,)."""
    angle = float(np.sqrt(turn @ turn))
    if angle < _SMALL:
        return rate
    axis = turn / angle
    sine = math.sin(angle) / angle
    along: Array = axis * (axis @ rate)
    across = (1.0 - math.cos(angle)) / angle * np.cross(axis, rate)
    return sine * rate + (1.0 - sine) * along + across


def symbolic_rotation_vector(rotation: ca.SX) -> ca.SX:
    """Axis times angle (3,), rad, of a rotation (3, 3) in symbols; angles up to pi."""
    axial = 0.5 * ca.vertcat(
        rotation[2, 1] - rotation[1, 2],
        rotation[0, 2] - rotation[2, 0],
        rotation[1, 0] - rotation[0, 1],
    )
    # Half a turn: R = 2 a a^T - I, and either sign of the axis is right.
    first, second, third = (rotation[:, k] + ca.SX.eye(3)[:, k] for k in range(3))
    column = ca.if_else(
        ca.fmax(rotation[1, 1], rotation[2, 2]) < rotation[0, 0],
        first,
        ca.if_else(rotation[2, 2] < rotation[1, 1], second, third),
    )
    axis = column / ca.fmax(ca.norm_2(column), _SMALL)
    return symbolic_angle_vector(axial, 0.5 * (ca.trace(rotation) - 1.0), axis)


def symbolic_angle_vector(across: ca.SX, cosine: ca.SX, otherwise: ca.SX) -> ca.SX:
    """Angle along ``across`` (3,), whose norm is the sine; half a turn goes about ``otherwise``."""
    sine = ca.norm_2(across)
    small = ca.if_else(cosine > 0.0, across, ca.pi * otherwise)
    factor = ca.atan2(sine, cosine) / ca.fmax(sine, _SMALL)
    return ca.if_else(sine > _SMALL, factor * across, small)

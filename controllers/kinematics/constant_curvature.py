"""The singularity-free form, vectorised over batches: lengths <-> (L, u, v) <-> tip pose.

``L`` is the backbone arc length (m), ``(u, v) = theta (cos phi, sin phi)`` the bending vector
(rad). Lengths are ``l_i = L - d (u cos alpha_i + v sin alpha_i)``: the chamber on the inside of
the bend is the shorter one. Nothing here divides by the bending angle, so the straight arm is a
point like any other. Source: the paper's Eq. (1), in the twist-free tip frame
``R = R_eq1 Rz(-phi)``.
"""

import numpy as np

from controllers.arm import CHAMBER_ANGLES_RAD, Arm, Array
from controllers.errors import InvalidInput

_COS = np.cos(CHAMBER_ANGLES_RAD)
_SIN = np.sin(CHAMBER_ANGLES_RAD)


def shapes_from_lengths(lengths_m: Array, chamber_offset_m: Array | float) -> Array:
    """Map chamber lengths ``(..., 3)`` to shapes ``(L, u, v)`` of the same shape.

    ``chamber_offset_m`` is d, a number or an array that broadcasts against ``(..., 1)``.
    """
    d = np.asarray(chamber_offset_m)
    first, second, third = lengths_m[..., 0:1], lengths_m[..., 1:2], lengths_m[..., 2:3]
    arc_length = (first + second + third) / 3.0
    u = ((second - first) + (third - first)) / (3.0 * d)
    v = (third - second) / (np.sqrt(3.0) * d)
    return np.concatenate([arc_length, u, v], axis=-1)


def lengths_from_shapes(shapes: Array, chamber_offset_m: Array | float) -> Array:
    """Map shapes ``(..., 3)`` of ``(L, u, v)`` to chamber lengths; inverse of the above."""
    arc_length, u, v = shapes[..., 0:1], shapes[..., 1:2], shapes[..., 2:3]
    return arc_length - np.asarray(chamber_offset_m) * (u * _COS + v * _SIN)


def section_transforms(shapes: Array) -> Array:
    """Transforms from a section's tip to its base, ``(..., 4, 4)``, for shapes ``(..., 3)``."""
    arc_length, u, v = np.moveaxis(shapes, -1, 0)
    theta = np.hypot(u, v)
    s = np.sinc(theta / np.pi)
    c = 0.5 * np.sinc(theta / (2.0 * np.pi)) ** 2
    zero, one = np.zeros_like(theta), np.ones_like(theta)
    rows = [
        [1.0 - u * u * c, -u * v * c, u * s, arc_length * u * c],
        [-u * v * c, 1.0 - v * v * c, v * s, arc_length * v * c],
        [-u * s, -v * s, np.cos(theta), arc_length * s],
        [zero, zero, zero, one],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def section_end_transforms(arm: Arm, lengths_m: Array) -> Array:
    """Transforms from the end of every section to the base, ``(..., n_sections, 4, 4)``.

    ``lengths_m`` has the shape ``(..., n_sections, 3)``; the last end is the tip.
    """
    local = section_transforms(shapes_from_lengths(lengths_m, arm.per_section("chamber_offset_m")))
    ends = [local[..., 0, :, :]]
    for index in range(1, arm.n_sections):
        ends.append(ends[-1] @ local[..., index, :, :])
    return np.stack(ends, axis=-3)


def tip_transform(arm: Arm, lengths_m: Array) -> Array:
    """Transform from the tip to the base, ``(..., 4, 4)``, for lengths ``(..., n_sections, 3)``."""
    return section_end_transforms(arm, lengths_m)[..., -1, :, :]


def curve_transforms(arm: Arm, lengths_m: Array, points_per_section: int) -> Array:
    """Frames along the backbone, base to tip, ``(n_sections * points_per_section + 1, 4, 4)``.

    ``lengths_m`` is one configuration ``(n_sections, 3)``. The first frame is the base.
    """
    shapes = shapes_from_lengths(lengths_m, arm.per_section("chamber_offset_m"))
    fractions = np.linspace(0.0, 1.0, points_per_section + 1)[1:, None]
    base = np.eye(4)
    frames = [base[None]]
    for shape in shapes:
        frames.append(base @ section_transforms(fractions * shape))
        base = frames[-1][-1]
    return np.concatenate(frames)


def section_inverse(position_m: Array) -> Array:
    """Shape ``(L, u, v)`` of the one section whose tip is at ``position_m``, both ``(..., 3)``.

    Raises InvalidInput for a non-finite position, for the base itself and for a point straight
    behind the base, where no direction of bending is distinguished.
    """
    position_m = np.asarray(position_m, dtype=np.float64)
    if not np.all(np.isfinite(position_m)):
        raise InvalidInput(f"position_m = {position_m.tolist()}: every coordinate must be finite")
    x, y, z = np.moveaxis(position_m, -1, 0)
    rho = np.hypot(x, y)
    if np.any((rho == 0.0) & (z <= 0.0)):
        raise InvalidInput("position_m lies at or straight behind the base: no arc ends there")
    theta = 2.0 * np.arctan2(rho, z)
    arc_length = np.hypot(rho, z) / np.sinc(theta / (2.0 * np.pi))
    straight = rho == 0.0
    ratio = np.where(
        straight, 2.0 / np.where(straight, z, 1.0), theta / np.where(straight, 1.0, rho)
    )
    return np.stack([arc_length, ratio * x, ratio * y], axis=-1)

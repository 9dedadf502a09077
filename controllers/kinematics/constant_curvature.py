"""The singularity-free form, vectorised over batches: lengths <-> (L, u, v) <-> tip pose.

``L`` is the backbone arc length (m), ``(u, v) = theta (cos phi, sin phi)`` the bending vector
(rad). Lengths are ``l_i = L - d (u cos alpha_i + v sin alpha_i)``: the chamber on the inside of
the bend is the shorter one. Nothing here divides by the bending angle, so the straight arm is a
point like any other. Source: the paper's Eq. (1), in the twist-free tip frame
``R = R_eq1 Rz(-phi)``; the arithmetic of batches is in
:mod:`pneuarm.controllers.kinematics.forward`.
"""

import numpy as np

from pneuarm.controllers.arm.arm import CHAMBER_ANGLES_RAD, Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics import checks
from pneuarm.controllers.kinematics.forward import fill_ends, fill_section, shapes_of_columns

_COS = np.cos(CHAMBER_ANGLES_RAD)
_SIN = np.sin(CHAMBER_ANGLES_RAD)


def shapes_from_lengths(lengths_m: Array, chamber_offset_m: Array | float) -> Array:
    """Map chamber lengths ``(..., 3)``, m, to shapes ``(L, u, v)`` of the same shape.

    ``chamber_offset_m`` is d, a number or an array that broadcasts against ``(..., 1)``.
    Raises InvalidInput for lengths that are not finite and for a d that is not above 0.
    """
    lengths_m = checks.finite("lengths_m", lengths_m, 3)
    d = checks.positive("chamber_offset_m", chamber_offset_m)
    first, second, third = lengths_m[..., 0:1], lengths_m[..., 1:2], lengths_m[..., 2:3]
    arc_length = (first + second + third) / 3.0
    u = ((second - first) + (third - first)) / (3.0 * d)
    v = (third - second) / (np.sqrt(3.0) * d)
    return np.concatenate(np.broadcast_arrays(arc_length, u, v), axis=-1)


def lengths_from_shapes(shapes: Array, chamber_offset_m: Array | float) -> Array:
    """Map shapes ``(..., 3)`` of ``(L, u, v)`` to chamber lengths, m; inverse of the above."""
    shapes = checks.finite("shapes", shapes, 3)
    d = checks.positive("chamber_offset_m", chamber_offset_m)
    arc_length, u, v = shapes[..., 0:1], shapes[..., 1:2], shapes[..., 2:3]
    return arc_length - d * (u * _COS + v * _SIN)


def section_transforms(shapes: Array) -> Array:
    """Transforms from a section's tip to its base, ``(..., 4, 4)``, for shapes ``(..., 3)``.

    Raises InvalidInput for a shape that is not finite.
    """
    shapes = checks.finite("shapes", shapes, 3)
    out = np.empty((*shapes.shape[:-1], 4, 4))
    fill_section(shapes.reshape(-1, 3), out.reshape(-1, 4, 4))
    return out


def section_end_transforms(arm: Arm, lengths_m: Array, out: Array | None = None) -> Array:
    """Transforms from the end of every section to the base, ``(..., n_sections, 4, 4)``.

    ``lengths_m`` has the shape ``(..., n_sections, 3)``; the last end is the tip. ``out`` takes
    the result, which saves the time to fetch new memory. Raises InvalidInput, with the index, for
    a length outside its section's open interval, Eq. (4).
    """
    return _arm_transforms(arm, lengths_m, out, arm.n_sections)


def tip_transform(arm: Arm, lengths_m: Array, out: Array | None = None) -> Array:
    """Transform from the tip to the base, ``(..., 4, 4)``, for lengths ``(..., n_sections, 3)``.

    ``out`` and InvalidInput as in :func:`section_end_transforms`.
    """
    if out is not None:
        out = _checked_out(out, (*np.shape(lengths_m)[:-2], 4, 4))[..., None, :, :]
    return _arm_transforms(arm, lengths_m, out, 1)[..., 0, :, :]


def _arm_transforms(arm: Arm, lengths_m: Array, out: Array | None, n_out: int) -> Array:
    """Transforms ``(..., n_out, 4, 4)`` of the last ``n_out`` section ends."""
    lengths_m = checks.shaped("lengths_m", lengths_m, arm.n_sections, 3)
    shape = (*lengths_m.shape[:-2], n_out, 4, 4)
    out = np.empty(shape) if out is None else _checked_out(out, shape)
    bounds = np.stack([arm.per_chamber("length_min_m"), arm.per_chamber("length_max_m")])
    flat = lengths_m.reshape(-1, arm.n_sections, 3)
    offsets = arm.per_section("chamber_offset_m")[:, 0]
    if not fill_ends(flat, offsets, bounds, out.reshape(-1, n_out, 4, 4)):
        checks.chamber_lengths(arm, lengths_m)
    return out


def _checked_out(out: Array, shape: tuple[int, ...]) -> Array:
    if out.shape != shape or out.dtype != np.float64 or not out.flags.c_contiguous:
        raise InvalidInput(
            f"out has the shape {out.shape} and type {out.dtype}: "
            f"a contiguous float64 array of the shape {shape} is needed"
        )
    return out


def curve_transforms(arm: Arm, lengths_m: Array, points_per_section: int) -> Array:
    """Frames along the backbone, base to tip, ``(n_sections * points_per_section + 1, 4, 4)``.

    ``lengths_m`` is one configuration ``(n_sections, 3)``; the first frame is the base. It draws
    what was measured: lengths outside Eq. (4) too, and a NaN as frames of NaN.
    """
    lengths_m = checks.shaped("lengths_m", lengths_m, arm.n_sections, 3)
    checks.within("points_per_section", points_per_section, 1, np.inf, "their number")
    offsets = arm.per_section("chamber_offset_m")[:, 0]
    fractions = np.linspace(0.0, 1.0, points_per_section + 1)[1:, None]
    base = np.eye(4)
    frames = [base[None]]
    for lengths, offset in zip(lengths_m, offsets, strict=True):
        local = np.empty((points_per_section, 4, 4))
        fill_section(fractions * shapes_of_columns(lengths[:, None], offset)[:, 0], local)
        frames.append(base @ local)
        base = frames[-1][-1]
    return np.concatenate(frames)


def section_inverse(position_m: Array) -> Array:
    """Shape ``(L, u, v)`` of the one section whose tip is at ``position_m``, both ``(..., 3)``.

    Raises InvalidInput, with the index, for a position that is not finite, for the base itself and
    for a point straight behind it, where no direction of bending is distinguished.
    """
    position_m = checks.finite("position_m", position_m, 3)
    x, y, z = np.moveaxis(position_m, -1, 0)
    rho = np.hypot(x, y)
    nowhere = (rho == 0.0) & (z <= 0.0)
    checks.refuse_where(
        nowhere, "position_m", position_m, "no arc ends at the base or straight behind it"
    )
    theta = 2.0 * np.arctan2(rho, z)
    arc_length = np.hypot(rho, z) / np.sinc(theta / (2.0 * np.pi))
    straight = rho == 0.0
    ratio = np.where(
        straight, 2.0 / np.where(straight, z, 1.0), theta / np.where(straight, 1.0, rho)
    )
    return np.stack([arc_length, ratio * x, ratio * y], axis=-1)

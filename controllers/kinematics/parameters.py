"""Maps between the three descriptions of a section, and the two tip frames by their names.

- arcs ``(phi, theta, r)``: the paper's, rad, rad, m. The straight arm has no phi and an infinite r.
- shapes ``(L, u, v)``: arc length (m) and bending vector (rad); no singularity.
- lengths ``(l1, l2, l3)``: chambers, m; see
:mod:`pneuarm.controllers.kinematics.constant_curvature`.

All arrays are ``(..., 3)``.
"""

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.kinematics import checks
from pneuarm.controllers.kinematics.constant_curvature import (
    lengths_from_shapes,
    shapes_from_lengths,
)

#: ``twist_free`` turns with the material and is the identity for a straight arm; ``paper`` is the
#: frame of Eq. (1), the twist-free one turned by phi about its own z axis.
Frame = Literal["twist_free", "paper"]


def shapes_from_arcs(arcs: ArrayLike) -> Array:
    """Map ``(phi, theta, r)`` to ``(L, u, v)``.

    Raises InvalidInput for a radius that is not above 0 or is infinite: a straight arm's length is
    not in these parameters.
    """
    arcs = checks.shaped("arcs", arcs, 3)
    phi, theta, radius = np.moveaxis(arcs, -1, 0)
    checks.finite("arcs (phi, rad)", phi)
    checks.finite("arcs (theta, rad)", theta)
    checks.positive("arcs (r, m)", radius, what="the radius of curvature")
    return np.stack([radius * theta, theta * np.cos(phi), theta * np.sin(phi)], axis=-1)


def arcs_from_shapes(shapes: ArrayLike) -> Array:
    """Map ``(L, u, v)`` to ``(phi, theta, r)`` with theta >= 0 and phi from -pi to pi.

    A straight arm gives ``(0, 0, inf)``. Raises InvalidInput for an L that is not above 0.
    """
    arc_length, u, v, theta = _split(shapes)
    with np.errstate(divide="ignore", over="ignore"):
        return np.stack([np.arctan2(v, u), theta, arc_length / theta], axis=-1)


def _split(shapes: ArrayLike) -> tuple[Array, ...]:
    shapes = checks.finite("shapes", shapes, 3)
    arc_length, u, v = np.moveaxis(shapes, -1, 0)
    checks.positive("shapes (L, m)", arc_length, what="the arc length")
    return arc_length, u, v, np.hypot(u, v)


def lengths_from_arcs(arcs: ArrayLike, chamber_offset_m: Array | float) -> Array:
    """Map ``(phi, theta, r)`` to chamber lengths; d, InvalidInput as in the maps it joins."""
    return lengths_from_shapes(shapes_from_arcs(arcs), chamber_offset_m)


def arcs_from_lengths(lengths_m: Array, chamber_offset_m: Array | float) -> Array:
    """Map chamber lengths to ``(phi, theta, r)``; d, InvalidInput as in the maps it joins."""
    return arcs_from_shapes(shapes_from_lengths(lengths_m, chamber_offset_m))


def arc_rates(shapes: ArrayLike) -> Array:
    """Derivative ``(..., 3, 3)`` of ``(L, u, v)`` over ``(phi, theta, r)`` at shapes ``(..., 3)``.

    Raises InvalidInput for the straight arm, where the paper's parameters have no derivative.
    """
    arc_length, u, v, theta = _split(shapes)
    straight = theta == 0.0
    checks.refuse_where(straight, "theta_rad", theta, "phi and r are defined above 0 only")
    zero = np.zeros_like(theta)
    rows = [[zero, arc_length / theta, theta], [-v, u / theta, zero], [u, v / theta, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def in_frame(transforms: ArrayLike, shapes: ArrayLike, frame: Frame) -> Array:
    """Twist-free end transforms ``(..., 4, 4)`` of sections as seen from the tip frame ``frame``.

    ``shapes`` (..., 3) are those of the section whose end it is; the straight arm has phi = 0.
    """
    return _turned("transforms", transforms, shapes, frame, 1.0)


def from_frame(transforms: ArrayLike, shapes: ArrayLike, frame: Frame) -> Array:
    """Inverse of :func:`in_frame`: transforms ``(..., 4, 4)`` of ``frame`` made twist-free."""
    return _turned("transforms", transforms, shapes, frame, -1.0)


def _turned(
    name: str, transforms: ArrayLike, shapes: ArrayLike, frame: Frame, sign: float
) -> Array:
    matrices = checks.transforms(name, transforms)
    shapes = checks.finite("shapes", shapes, 3)
    checks.one_of("frame", frame, get_args(Frame))
    if frame == "twist_free":
        return matrices
    phi = np.arctan2(shapes[..., 2], shapes[..., 1])[..., None]
    c, s = np.cos(phi), sign * np.sin(phi)
    x, y = matrices[..., :3, 0], matrices[..., :3, 1]
    turned = np.broadcast_to(matrices, (*np.broadcast_shapes(phi.shape, x.shape)[:-1], 4, 4)).copy()
    turned[..., :3, 0] = c * x + s * y
    turned[..., :3, 1] = c * y - s * x
    return turned

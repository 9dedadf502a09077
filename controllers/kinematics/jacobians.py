"""Jacobians of the singularity-free form, at the tip or anywhere along the backbone, for batches.

With the rotation vector ``w = (-v, u, 0)`` a section's rotation is ``exp([w])`` and its tip lies at
``L J z``, where ``J = 1 + C [w] + E [w]^2`` is the left Jacobian of the rotations and z the third
unit vector. So the tip turns with ``J w_dot`` and nothing divides by the bending angle. The paper's
Jacobian over ``(phi, theta, r)``, Eq. (2) and (3), is that of
:mod:`pneuarm.controllers.kinematics.serial_chain`.

A *station* names a point of the backbone: its whole part counts the sections below it, the rest is
the fraction of the section it lies in; 0 is the base, ``n_sections`` the tip. A Jacobian is that of
the material point: its station stays as the arm moves. A Jacobian's rows are velocity over angular
velocity, its columns the chamber lengths or the ``(L, u, v)`` of every section, base first.
"""

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics import checks
from pneuarm.controllers.kinematics.constant_curvature import (
    section_transforms,
    shapes_from_lengths,
)
from pneuarm.controllers.kinematics.smooth import smooth

Over = Literal["lengths", "shapes"]
Seen = Literal["base", "body"]


def section_jacobians(shapes: ArrayLike) -> Array:
    """Jacobians ``(..., 6, 3)`` of one section's tip over ``(L, u, v)``, in its base frame.

    Raises InvalidInput for a shape that is not finite.
    """
    shapes = checks.finite("shapes", shapes, 3)
    arc_length, u, v = np.moveaxis(shapes, -1, 0)
    f = smooth(u * u + v * v)
    uv, du, dv = u * v, 2.0 * u * f.ds, 2.0 * v * f.ds
    dc = 2.0 * f.dc
    zero = np.zeros_like(u)
    rows = (
        (u * f.c, arc_length * (f.c + u * u * dc), arc_length * uv * dc),
        (v * f.c, arc_length * uv * dc, arc_length * (f.c + v * v * dc)),
        (f.s, arc_length * du, arc_length * dv),
        (zero, -f.e * uv, f.e * u * u - 1.0),
        (zero, 1.0 - f.e * v * v, f.e * uv),
        (zero, -f.c * v, f.c * u),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def shape_rates(chamber_offset_m: Array | float) -> Array:
    """Constant derivative ``(..., 3, 3)`` of ``(L, u, v)`` over the lengths; d is ``(...)``, m."""
    d = checks.positive("chamber_offset_m", chamber_offset_m)
    return np.swapaxes(shapes_from_lengths(np.eye(3), d[..., None, None]), -1, -2)


def stations_at(arm: Arm, lengths_m: ArrayLike, arc_length_m: ArrayLike) -> Array:
    """Stations ``(...)`` of the points ``arc_length_m`` (...) from the base, along the backbone.

    ``lengths_m`` is ``(..., n_sections, 3)``. Raises InvalidInput for a point beyond the ends.
    """
    lengths = checks.chamber_lengths(arm, lengths_m)
    places = checks.finite("arc_length_m", arc_length_m)
    checks.broadcast(lengths_m=lengths[..., 0, 0], arc_length_m=places)
    sections = lengths.mean(axis=-1)
    ends = np.cumsum(sections, axis=-1)
    places, tip = np.broadcast_arrays(places, ends[..., -1])
    bad = (places < 0.0) | (places > tip * (1.0 + 1e-12))
    checks.refuse_where(bad, "arc_length_m", places, "it must lie between base (0) and tip")
    starts = ends - sections
    stations: Array = np.clip((places[..., None] - starts) / sections, 0.0, 1.0).sum(axis=-1)
    return stations


def _walk(arm: Arm, lengths_m: ArrayLike, stations: ArrayLike | None) -> tuple[Array, Array]:
    """Shapes up to the station ``(..., n_sections, 3)``, and the fractions ``(..., n_sections)``.

    Beyond the station a section has the shape 0: its transform is the identity.
    """
    lengths = checks.chamber_lengths(arm, lengths_m)
    n = arm.n_sections
    ends = checks.within("stations", n if stations is None else stations, 0, n, "a station")
    checks.broadcast(lengths_m=lengths[..., 0, 0], stations=ends)
    fractions = np.clip(ends[..., None] - np.arange(n), 0.0, 1.0)
    shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))
    shapes = fractions[..., None] * shapes
    return shapes, np.broadcast_to(fractions, shapes.shape[:-1])


def station_transforms(arm: Arm, lengths_m: ArrayLike, stations: ArrayLike | None = None) -> Array:
    """Transforms ``(..., 4, 4)`` from the stations ``(...)``, by default the tip, to the base.

    ``lengths_m`` is ``(..., n_sections, 3)``. Raises InvalidInput for a length outside Eq. (4)
    and for a station that is not between 0 and ``n_sections``.
    """
    local = section_transforms(_walk(arm, lengths_m, stations)[0])
    result = local[..., 0, :, :]
    for index in range(1, arm.n_sections):
        result = result @ local[..., index, :, :]
    return result


def jacobians(
    arm: Arm,
    lengths_m: ArrayLike,
    stations: ArrayLike | None = None,
    over: Over = "lengths",
    seen_from: Seen = "base",
) -> Array:
    """Jacobians ``(..., 6, 3 n_sections)`` at the stations ``(...)``, by default at the tip.

    ``over`` names the columns' variables; ``seen_from`` the axes in which the velocity of the
    point and the angular velocity are written: the base's, or the (twist-free) ones of the point.
    ``lengths_m`` is ``(..., n_sections, 3)``. Raises InvalidInput as :func:`station_transforms`.
    """
    checks.one_of("over", over, get_args(Over))
    checks.one_of("seen_from", seen_from, get_args(Seen))
    shapes, fractions = _walk(arm, lengths_m, stations)
    local = section_transforms(shapes)
    columns = fractions[..., None, None] * section_jacobians(shapes)
    if over == "lengths":
        columns = columns @ shape_rates(arm.per_section("chamber_offset_m")[:, 0])
    return _in_chain(local, columns, seen_from)


def _in_chain(local: Array, columns: Array, seen_from: Seen) -> Array:
    """Join section Jacobians (..., n, 6, 3) by their transforms (..., n, 4, 4), tip to base.

    Walking from the point back: behind a section lie ``rotation`` and ``arm_m``, what follows
    it, in the axes of its end. A section turns what follows and moves it by the lever.
    """
    rotation, lever = np.eye(3), np.zeros(3)
    blocks: list[Array] = []
    for index in reversed(range(local.shape[-3])):
        section = columns[..., index, :, :]
        turn = local[..., index, :3, :3]
        swung = np.einsum("...ij,...j->...i", turn, np.broadcast_to(lever, (*turn.shape[:-2], 3)))
        angular = section[..., 3:, :]
        linear = section[..., :3, :] + np.cross(angular, swung[..., :, None], axis=-2)
        inverse = np.swapaxes(turn @ rotation, -1, -2)
        blocks.insert(0, np.concatenate([inverse @ linear, inverse @ angular], axis=-2))
        rotation, lever = turn @ rotation, local[..., index, :3, 3] + swung
    body = np.concatenate(blocks, axis=-1)
    if seen_from == "body":
        return body
    return np.concatenate([rotation @ body[..., :3, :], rotation @ body[..., 3:, :]], axis=-2)

"""How far an arm of any number of sections reaches in a direction: its support function.

Without a search among all chambers at once: beyond section k the rest of the arm adds the most in
a direction ``n`` when it reaches furthest along ``R_k^T n``, so with ``h_k`` for the reach of the
sections from k on (Bellman's principle)

    h_k(n) = max over (L, u, v) of section k of  n . p_k(L, u, v) + h_{k+1}(R_k(u, v)^T n)

and ``h`` behind the tip is 0. Every maximum is global up to the grid: L enters linearly, so one of
its ends is best, and two unknowns remain. ``h`` is tabulated over the wedge of directions (all
sections share the symmetry of :mod:`pneuarm.controllers.workspace.region`) and interpolated.
"""

from dataclasses import replace

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.constant_curvature import (
    lengths_from_shapes,
    section_transforms,
    tip_transform,
)
from pneuarm.controllers.workspace.region import WEDGE_RAD, SectionRegion

_POLAR, _AROUND = np.linspace(0.0, np.pi, 61), np.linspace(0.0, WEDGE_RAD, 21)
_PHI, _SHARE = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False), np.linspace(0.0, 1.0, 17)
_WINDOW = np.stack(np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-1, 1, 5)), axis=-1).reshape(
    -1, 2
)
_ZOOMS = 8


def in_wedge(phi: Array) -> Array:
    """Fold angles into ``0 .. 60 deg``."""
    folded: Array = np.abs((phi + WEDGE_RAD) % (2.0 * WEDGE_RAD) - WEDGE_RAD)
    return folded


def wedge_directions(count: int) -> Array:
    """Directions ``(count, 3)`` spread evenly over the wedge (a Fibonacci lattice)."""
    index = np.arange(count) + 0.5
    z = 1.0 - 2.0 * index / count
    phi = WEDGE_RAD * ((index * 0.6180339887498949) % 1.0)
    ring = np.sqrt(1.0 - z * z)
    return np.stack([ring * np.cos(phi), ring * np.sin(phi), z], axis=-1)


class _Stage:
    """One section of the arm and the reach of the sections beyond it."""

    def __init__(self, region: SectionRegion, beyond: "_Stage | None") -> None:
        self._region = region
        self._beyond = beyond
        polar, around = (a.reshape(-1) for a in np.meshgrid(_POLAR, _AROUND, indexing="ij"))
        ring = np.sin(polar)
        nodes = np.stack([ring * np.cos(around), ring * np.sin(around), np.cos(polar)], axis=-1)
        values = self.best(nodes)[1].reshape(len(_POLAR), len(_AROUND))
        self._table = RegularGridInterpolator((_POLAR, _AROUND), values)

    def reach_m(self, directions: Array) -> Array:
        """Interpolated reach in unit directions ``(..., 3)``."""
        x, y, z = np.moveaxis(directions, -1, 0)
        place = np.stack([np.arctan2(np.hypot(x, y), z), in_wedge(np.arctan2(y, x))], axis=-1)
        reach: Array = self._table(place)
        return reach

    def best(self, directions: Array) -> tuple[Array, Array]:
        """Shapes ``(n, 3)`` that reach furthest in ``directions`` (n, 3), and the reach (n,)."""
        grid = np.stack(np.meshgrid(_PHI, _SHARE), axis=-1).reshape(1, -1, 2)
        shapes, values = self._tried(directions, grid)
        rows = np.arange(len(directions))
        place = grid[0, values.argmax(axis=1)]
        step = np.array([_PHI[1], _SHARE[1]])
        for _ in range(_ZOOMS):
            around = place[:, None] + step * _WINDOW
            around[..., 1] = np.clip(around[..., 1], 0.0, 1.0)
            shapes, values = self._tried(directions, around)
            best = values.argmax(axis=1)
            place, step = around[rows, best], 0.5 * step
        return shapes[rows, best], values[rows, best]

    def _tried(self, directions: Array, places: Array) -> tuple[Array, Array]:
        """Shapes at places ``(n or 1, m, 2)`` of direction and share of the bend, and reaches."""
        phi, share = places[..., 0], places[..., 1]
        theta = share * self._region.bend_end_rad(in_wedge(phi))
        low, high = self._region.arc_lengths_m(theta, in_wedge(phi))
        uv = np.stack([theta * np.cos(phi), theta * np.sin(phi)], axis=-1)
        unit = section_transforms(np.concatenate([np.ones((*phi.shape, 1)), uv], axis=-1))
        per_metre = np.einsum("...i,...i->...", unit[..., :3, 3], directions[:, None])
        arc_length = np.where(per_metre > 0.0, high, low)
        values = arc_length * per_metre
        if self._beyond is not None:
            onward = np.einsum("...ji,...j->...i", unit[..., :3, :3], directions[:, None])
            values = values + self._beyond.reach_m(onward)
        uv = np.broadcast_to(uv, (*values.shape, 2))
        return np.concatenate([arc_length[..., None], uv], axis=-1), values


class Support:
    """The support function of an arm's workspace, and the configurations that attain it."""

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        beyond: _Stage | None = None
        self._stages: list[_Stage] = []
        for section in reversed(arm.sections):
            beyond = _Stage(SectionRegion(replace(arm, sections=(section,))), beyond)
            self._stages.insert(0, beyond)

    def furthest(self, directions: Array) -> tuple[Array, Array, Array]:
        """Find what reaches furthest in unit directions ``(n, 3)``.

        Returns the lengths ``(n, n_sections, 3)``, the tips (n, 3) they stand for, and (n,) how
        much the interpolated reach differs from theirs (m): the numerical error.
        """
        shapes, onward, promised = [], directions, None
        for stage in self._stages:
            shape, value = stage.best(onward)
            promised = value if promised is None else promised
            shapes.append(shape)
            rotations = section_transforms(shape)[:, :3, :3]
            onward = np.einsum("nji,nj->ni", rotations, onward)
        offset_m = self._arm.per_section("chamber_offset_m")
        lengths = lengths_from_shapes(np.stack(shapes, axis=1), offset_m)
        tips = tip_transform(self._arm, lengths)[:, :3, 3]
        attained = np.einsum("ni,ni->n", tips, directions)
        return lengths, tips, np.abs(np.asarray(promised) - attained)

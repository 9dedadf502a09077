"""The boundary of a workspace as a closed surface of triangles.

One section: the three sheets of :mod:`pneuarm.controllers.workspace.region` on one grid of
directions of bending and of rings from the near pole of the axis over the bend limit to the far
pole. All creases of the surface are edges of the mesh, so its error falls with the square of the
width of a triangle. Several sections: the convex hull of the points furthest out, which holds the
workspace but also what the workspace may lack: an outer hull.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.workspace.region import WEDGE_RAD, SectionRegion, Sheet

Indices = NDArray[np.int64]

#: A side lower than this (m) is an edge: there the box of the lengths ends before the bend does.
_NO_SIDE_M = 1e-9


@dataclass(frozen=True)
class Mesh:
    """A surface: ``vertices_m`` (n, 3), ``triangles`` (m, 3), counterclockwise from outside.

    ``outer_hull`` is True if the surface holds more than the workspace.
    """

    vertices_m: Array
    triangles: Indices
    outer_hull: bool = False

    @property
    def corners_m(self) -> Array:
        """Corners of every triangle, ``(m, 3, 3)``."""
        return self.vertices_m[self.triangles]

    @property
    def volume_m3(self) -> float:
        """Volume inside, positive if the triangles look outward (divergence theorem)."""
        a, b, c = np.moveaxis(self.corners_m, 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)

    @property
    def is_watertight(self) -> bool:
        """Whether every edge belongs to two triangles, once in each direction."""
        edges = self.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        code = edges[:, 0] * len(self.vertices_m) + edges[:, 1]
        back = edges[:, 1] * len(self.vertices_m) + edges[:, 0]
        return len(np.unique(code)) == len(code) and np.array_equal(np.sort(code), np.sort(back))


def section_mesh(region: SectionRegion, cells: int = 24) -> Mesh:
    """Mesh of one section's workspace with ``cells`` (at least 2) along each side of each sheet.

    Raises InvalidInput for fewer.
    """
    if cells < 2:
        raise InvalidInput(f"cells = {cells}: at least 2 are needed")
    phi, in_wedge = _directions(region, cells)
    sheets, along = _rings(cells)
    rho, z = region.meridian(sheets[:, None], in_wedge, along[:, None])
    grid = np.stack([rho * np.cos(phi), rho * np.sin(phi), z], axis=-1)
    triangles = _triangles(_shared_vertices(region, in_wedge, cells))
    used, renumbered = np.unique(triangles, return_inverse=True)
    return Mesh(grid.reshape(-1, 3)[used], renumbered.reshape(-1, 3).astype(np.int64))


def _directions(region: SectionRegion, cells: int) -> tuple[Array, Array]:
    """Directions of bending all the way round, and the same folded into the wedge."""
    kinks = region.kinks_rad()
    parts = [
        np.linspace(a, b, max(2, round(cells * (b - a) / WEDGE_RAD)) + 1)[:-1]
        for a, b in pairwise(kinks)
    ]
    wedge = np.concatenate([*parts, [WEDGE_RAD]])
    folded = np.concatenate([wedge[:-1], wedge[:0:-1]])
    turned = np.concatenate([wedge[:-1], 2.0 * WEDGE_RAD - wedge[:0:-1]])
    phi = np.concatenate([turned + 2.0 * WEDGE_RAD * third for third in range(3)])
    return phi, np.tile(folded, 3)


def _rings(cells: int) -> tuple[Indices, Array]:
    """Sheet and place on it of every ring, from the near pole to the far one."""
    out = np.linspace(0.0, 1.0, cells + 1)
    sheets = np.repeat([Sheet.LOWER, Sheet.SIDE, Sheet.UPPER], [cells + 1, cells - 1, cells + 1])
    return sheets.astype(np.int64), np.concatenate([out, out[1:-1], out[::-1]])


def _shared_vertices(region: SectionRegion, in_wedge: Array, cells: int) -> Indices:
    """Vertex number of every node ``(rings, directions)``: one a pole, one where the side is 0."""
    rings, columns = 3 * cells + 1, len(in_wedge)
    numbers = np.arange(rings * columns).reshape(rings, columns)
    numbers[0], numbers[-1] = numbers[0, 0], numbers[-1, 0]
    low, high = region.arc_lengths_m(region.bend_end_rad(in_wedge), in_wedge)
    edge = high - low < _NO_SIDE_M
    numbers[cells + 1 : 2 * cells + 1, edge] = numbers[cells, edge]
    return numbers


def _triangles(numbers: Indices) -> Indices:
    """Two triangles a cell of the grid, which closes in its second direction; none degenerate."""
    here, right = numbers, np.roll(numbers, -1, axis=1)
    a, b, c, d = here[:-1], right[:-1], right[1:], here[1:]
    both = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
    triangles: Indices = both.reshape(-1, 3)
    first, second, third = triangles.T
    whole: Indices = triangles[(first != second) & (second != third) & (third != first)]
    return whole


def hull_mesh(points_m: Array) -> Mesh:
    """Convex hull of points ``(n, 3)``, looking outward."""
    hull = ConvexHull(points_m)
    used, renumbered = np.unique(hull.simplices, return_inverse=True)
    triangles = renumbered.reshape(-1, 3).astype(np.int64)
    vertices = points_m[used]
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return Mesh(vertices, triangles, outer_hull=True)

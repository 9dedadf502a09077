"""Extents, outer hull and volume of several sections' workspace.

Extents and hull come from the support function, global up to its grid. The hull is convex, so it
holds the workspace and more than that: an outer hull. The volume is an estimate, by searches for
random points.
"""

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.workspace.mesh import Mesh, hull_mesh
from pneuarm.controllers.workspace.region import WEDGE_RAD, unfolded
from pneuarm.controllers.workspace.sampling import share_of
from pneuarm.controllers.workspace.search import SearchedRegion
from pneuarm.controllers.workspace.support import Support, wedge_directions
from pneuarm.controllers.workspace.volume import Figure

_AXES = np.concatenate([-np.eye(3), np.eye(3)])
_ENLARGED = 1.02


class SearchedShape:
    """The outline of one arm's workspace."""

    def __init__(self, arm: Arm, region: SearchedRegion) -> None:
        self._arm = arm
        self._region = region
        self._support = Support(arm)

    def extents_m(self) -> tuple[Array, float]:
        """Least and greatest x, y and z ``(2, 3)``, and their numerical error (m)."""
        _, tips, errors = self._support.furthest(_AXES)
        furthest = np.einsum("ij,ij->i", tips, _AXES)
        return np.stack([-furthest[:3], furthest[3:]]), float(errors.max())

    def hull(self, directions: int = 300) -> Mesh:
        """Outer hull through the points furthest out in ``directions`` of the wedge, mirrored."""
        along_axis = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
        wanted = np.concatenate([wedge_directions(directions), along_axis])
        _, tips, _ = self._support.furthest(wanted)
        turns = [(2.0 * WEDGE_RAD * third, side) for third in range(3) for side in (1.0, -1.0)]
        images = [unfolded(tips.T, turn, side).T for turn, side in turns]
        return hull_mesh(np.unique(np.round(np.concatenate(images), 9), axis=0))

    def hull_volume(self, directions: int = 300) -> Figure:
        """Volume (m^3) of the hull, which no volume of the workspace exceeds.

        The error is the difference to a third of the directions.
        """
        fine, coarse = self.hull(directions).volume_m3, self.hull(directions // 3).volume_m3
        return Figure(fine, abs(fine - coarse), "convex outer hull: at most this")

    def volume(self, hull: Mesh, count: int, rng: np.random.Generator) -> Figure:
        """Volume (m^3) from searches for ``count`` random points in the hull, a little enlarged.

        The error is statistical; members that the search misses come on top.
        """
        middle_m = hull.vertices_m.mean(axis=0)
        # The hull runs through points of the boundary, so between them it is a little too small.
        larger = Mesh(middle_m + _ENLARGED * (hull.vertices_m - middle_m), hull.triangles, True)
        hits = int(self._region.contains(uniform_inside(larger, count, rng)).sum())
        figure = share_of(larger.volume_m3, hits, count)
        return Figure(figure.value, figure.error, f"search for {figure.method}")


def uniform_inside(hull: Mesh, count: int, rng: np.random.Generator) -> Array:
    """Points ``(count, 3)`` uniform in a convex mesh."""
    low, high = hull.vertices_m.min(axis=0), hull.vertices_m.max(axis=0)
    found = np.empty((0, 3))
    while len(found) < count:
        points = rng.uniform(low, high, (count, 3))
        found = np.concatenate([found, points[inside_convex(hull, points, 0.0)]])
    return found[:count]


def inside_convex(hull: Mesh, points_m: Array, margin_m: float) -> np.ndarray:
    """Which points ``(n, 3)`` lie in a convex mesh, or outside by at most ``margin_m``."""
    a, b, c = np.moveaxis(hull.corners_m, 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    outside = points_m @ normals.T - np.einsum("ij,ij->i", a, normals)
    return np.asarray(outside.max(axis=1) <= margin_m)

"""Volume and extents of one section's workspace, each with its numerical error.

The volume three times, by ways that share little: an integral in shapes, the mesh, and random
points put to the exact test.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.workspace.mesh import section_mesh
from pneuarm.controllers.workspace.nearest import BoundarySearch
from pneuarm.controllers.workspace.region import WEDGE_RAD, SectionRegion

_AXES = np.concatenate([-np.eye(3), np.eye(3)])
_SEARCH_ERROR_M = 1e-8


@dataclass(frozen=True)
class Figure:
    """A figure and its numerical error, in the same unit; ``method`` says where both come from."""

    value: float
    error: float
    method: str


def integrated_volume(region: SectionRegion, nodes: int = 32) -> Figure:
    """Volume (m^3) by Gauss-Legendre quadrature in shapes.

    ``dV = L^2 C^2 dL du dv`` with ``C = (1 - cos theta)/theta^2``, so the integral over L is
    closed, and the rest is smooth between the kinks. The error is the difference to half as many
    nodes, or rounding.
    """
    value, coarse = _integral(region, nodes), _integral(region, nodes // 2)
    error = max(abs(value - coarse), 1e-15 * nodes * value)
    return Figure(value, error, f"quadrature in shapes, {nodes} against {nodes // 2} nodes")


def _integral(region: SectionRegion, nodes: int) -> float:
    place, weight = np.polynomial.legendre.leggauss(nodes)
    place, weight = 0.5 * (place + 1.0), 0.5 * weight
    kinks, total = region.kinks_rad(), 0.0
    for start, width in zip(kinks[:-1], np.diff(kinks), strict=True):
        phi = (start + width * place)[:, None]
        end = region.bend_end_rad(phi)
        theta = end * place
        low, high = region.arc_lengths_m(theta, phi)
        c = 0.5 * np.sinc(theta / (2.0 * np.pi)) ** 2
        density = theta * c**2 * (high**3 - low**3) / 3.0
        total += 2.0 * np.pi / WEDGE_RAD * width * float(weight @ (density * end) @ weight)
    return float(total)


def meshed_volume(region: SectionRegion, cells: int = 48) -> Figure:
    """Volume (m^3) of the mesh, extrapolated from three widths of its triangles (Richardson).

    The error is what the extrapolation still changed with the last refinement.
    """
    volumes = [section_mesh(region, cells // part).volume_m3 for part in (4, 2, 1)]
    coarse, fine = ((4.0 * b - a) / 3.0 for a, b in pairwise(volumes))
    return Figure(fine, abs(fine - coarse), f"mesh, {cells // 4}, {cells // 2}, {cells} cells")


def extents_m(region: SectionRegion) -> Array:
    """Least and greatest x, y and z, shape ``(2, 3)``."""
    search = BoundarySearch(region)
    furthest = np.array([search.furthest_m(axis) @ axis for axis in _AXES])
    return np.stack([-furthest[:3], furthest[3:]])


def extents_error_m(region: SectionRegion, cells: int = 48) -> float:
    """How far the extents of the finest mesh, another way to find them, are from the search's."""
    vertices = section_mesh(region, cells).vertices_m
    meshed = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
    return max(float(np.abs(meshed - extents_m(region)).max()), _SEARCH_ERROR_M)


def least_radius_over_offset(region: SectionRegion) -> float:
    """Least radius of curvature over the chambers' distance from the backbone.

    Above 1 the chambers stay clear of the centre of curvature, so that no fold is possible.
    """
    phi = np.linspace(0.0, WEDGE_RAD, 601)
    theta = region.bend_end_rad(phi)
    return float((region.arc_lengths_m(theta, phi)[0] / theta).min() / region.offset_m)

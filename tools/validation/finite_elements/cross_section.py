"""The mesh of the cross-section: eight-node quadrilaterals, the same in every layer of the arm.

Around every chamber lie, from inside out: a core and a ring that fill the bore (in the plates
only), the wall, and the web (in discs and plates). The webs of the three chambers meet along the
sector lines at 60, 180 and 300 degrees, where their nodes coincide.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tools.validation.finite_elements.design import Design, Divisions

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CORE, RING, WALL, WEB = range(4)


@dataclass(frozen=True)
class CrossSection:
    """Points (n, 2) in mm and quads (m, 8): four corners counter-clockwise, then the mid-sides.

    ``region`` and ``chamber`` say to what a quad belongs; ``innermost`` marks the wall quads whose
    fourth side (from the fourth corner to the first) lies on the bore.
    """

    points: Array
    quads: Indices
    region: Indices
    chamber: Indices
    innermost: NDArray[np.bool_]


def cross_section(design: Design, divisions: Divisions) -> CrossSection:
    """Mesh the cross-section; points that coincide to 1e-6 mm are one."""
    blocks = _chamber_blocks(design, divisions)
    axis = np.array([design.chamber_offset, 0.0])
    corners, tags = [], []
    for chamber in range(3):
        turn = _rotation(2.0 * np.pi * chamber / 3.0)
        for region, grid in blocks:
            block = _quads((grid + axis) @ turn.T)
            first_row = np.arange(len(block)) < (grid.shape[1] - 1) // 2
            corners.append(block)
            tags += [(region, chamber, region == WALL and inner) for inner in first_row]
    points, quads = _merged(np.concatenate(corners))
    region, chamber_of, innermost = np.array(tags, dtype=np.int64).T
    return CrossSection(points, quads, region, chamber_of, innermost.astype(np.bool_))


def _chamber_blocks(design: Design, divisions: Divisions) -> list[tuple[int, Array]]:
    """Grids (2a+1, 2b+1, 2) of corners and mid-sides around a chamber axis at the origin."""
    angles = np.linspace(0.0, 2.0 * np.pi, 2 * divisions.around + 1)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    bore, outside = design.inner_radius * circle, design.outer_radius * circle
    core = _core(0.55 * design.inner_radius, divisions.around // 4)
    web = _web_radius(design, angles)[:, None] * circle
    return [
        (CORE, core),
        (RING, _between(_core_outline(core), bore, 1)),
        (WALL, _between(bore, outside, divisions.through_wall)),
        (WEB, _between(outside, web, divisions.web)),
    ]


def _web_radius(design: Design, angles: Array) -> Array:
    """Distance (mm) from a chamber's axis to the outline of its part of the disc."""
    from_inward = np.abs(angles - np.pi)
    d = design.chamber_offset
    to_sector_line = d * np.sin(np.pi / 3.0) / np.cos(np.abs(from_inward - np.pi / 6.0))
    share = (np.pi - from_inward) / (2.0 * np.pi / 3.0)
    rim = design.rim_radius + (d - design.rim_radius) * share
    return np.where(from_inward <= np.pi / 3.0 + 1e-9, to_sector_line, rim)


def _core(radius: float, elements: int) -> Array:
    """A square on its corner, ``elements`` wide, that fills the middle of the bore."""
    along = np.linspace(-0.5, 0.5, 2 * elements + 1)
    square = np.stack(np.meshgrid(along, along, indexing="ij"), axis=-1)
    return np.asarray(square * np.sqrt(2.0) * radius @ _rotation(np.pi / 4.0).T)


def _core_outline(core: Array) -> Array:
    """The outline of the core, counter-clockwise from its corner on the x axis, closed."""
    sides = [core[-1, :], core[::-1, -1], core[0, ::-1], core[:, 0]]
    outline = np.concatenate([side[:-1] for side in sides])
    start = int(np.argmax(outline[:, 0]))
    outline = np.roll(outline, -start, axis=0)
    return np.concatenate([outline, outline[:1]])


def _between(inside: Array, outside: Array, elements: int) -> Array:
    """Grid between two curves of equal length: rows go outward, columns around."""
    share = np.linspace(0.0, 1.0, 2 * elements + 1)[:, None, None]
    return np.asarray((1.0 - share) * inside + share * outside)


def _quads(grid: Array) -> Array:
    """Cut a grid (2a+1, 2b+1, 2) into a*b quads of eight points, ``(a*b, 8, 2)``."""
    steps = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    rows, columns = grid.shape[0] - 2, grid.shape[1] - 2
    parts = [grid[i : i + rows : 2, j : j + columns : 2] for i, j in steps]
    return np.stack(parts, axis=2).reshape(-1, 8, 2)


def _merged(corners: Array) -> tuple[Array, Indices]:
    rounded = np.round(corners.reshape(-1, 2), 6) + 0.0
    points, index = np.unique(rounded, axis=0, return_inverse=True)
    return points, np.asarray(index, dtype=np.int64).reshape(-1, 8)


def _rotation(angle: float) -> Array:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

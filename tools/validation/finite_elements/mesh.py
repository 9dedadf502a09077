"""The solid mesh: the cross-section, layer upon layer, as twenty-node hexahedra with their sets.

Layers from the base up: base plate, then gaps and discs in turn, then the tip plate. The wall of a
chamber runs through all of them; ``z = 0`` and ``z = l0`` are the plates' inner faces, the caps.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tools.validation.finite_elements.cross_section import CORE, RING, WALL, WEB, cross_section
from tools.validation.finite_elements.design import Design, Divisions

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

PLATE, DISC, GAP = "plate", "disc", "gap"
REGIONS = {PLATE: (CORE, RING, WALL, WEB), DISC: (WALL, WEB), GAP: (WALL,)}

#: Faces of a hexahedron as CalculiX numbers them: bottom, top, and the side on the bore.
BOTTOM, TOP, INWARD = 1, 2, 6


@dataclass(frozen=True)
class Mesh:
    """Nodes (n, 3) in mm, hexahedra (m, 20) in CalculiX's order, and what belongs to what.

    ``parts`` names sets of elements, one per material and orientation; ``pressed[i]`` lists the
    faces inside chamber i as (elements, face number); ``rings[i]`` holds for chamber i the nodes of
    its wall in every level from cap to cap, ``(levels, nodes of a ring)``.
    """

    nodes: Array
    hexes: Indices
    parts: dict[str, Indices]
    pressed: tuple[tuple[tuple[Indices, int], ...], ...]
    rings: Indices
    base_nodes: Indices
    tip_nodes: Indices


def layers(design: Design, divisions: Divisions) -> list[tuple[str, float]]:
    """Kind and thickness (mm) of every layer of elements, from the base plate to the tip plate."""
    gaps = design.discs + 1
    gap = (design.rest_length - design.discs * design.disc_thickness) / gaps
    per_gap = divisions.along // gaps
    one_gap = [(GAP, gap / per_gap)] * per_gap
    inside = [*one_gap, (DISC, design.disc_thickness)] * design.discs + one_gap
    plate = (PLATE, design.plate_thickness)
    return [plate, *inside, plate]


def build_mesh(design: Design, divisions: Divisions) -> Mesh:
    """Stack the layers and collect the sets."""
    flat = cross_section(design, divisions)
    stack = layers(design, divisions)
    chosen = [np.flatnonzero(np.isin(flat.region, REGIONS[kind])) for kind, _ in stack]
    layer = np.repeat(np.arange(len(stack)), [len(quads) for quads in chosen])
    quad = np.concatenate(chosen)
    n = len(flat.points)
    hexes = _hexes(flat.quads[quad], layer, n)
    region, chamber = flat.region[quad], flat.chamber[quad]
    kind = np.array([name for name, _ in stack])[layer]
    last = len(stack) - 1
    used, compact = np.unique(hexes, return_inverse=True)
    renumbered = np.full((2 * len(stack) + 1) * n, -1)
    renumbered[used] = np.arange(len(used))
    bore = np.isin(region, (CORE, RING))
    inward = flat.innermost[quad] & (kind != PLATE)
    return Mesh(
        nodes=_node_positions(flat.points, _levels(design, stack))[used],
        hexes=np.asarray(compact, dtype=np.int64).reshape(-1, 20),
        parts=_parts(kind, region, chamber),
        pressed=tuple(
            (
                (np.flatnonzero(inward & (chamber == i)), INWARD),
                (np.flatnonzero(bore & (layer == 0) & (chamber == i)), TOP),
                (np.flatnonzero(bore & (layer == last) & (chamber == i)), BOTTOM),
            )
            for i in range(3)
        ),
        rings=_rings(flat.quads[:, :4], (flat.region == WALL), flat.chamber, renumbered, n),
        base_nodes=np.unique(renumbered[hexes[layer == 0]]),
        tip_nodes=np.unique(renumbered[hexes[layer == last]]),
    )


def _hexes(quads: Indices, layer: Indices, n: int) -> Indices:
    """Node numbers before unused ones are dropped: level * n + point, two levels a layer."""
    low, middle, high = (n * (2 * layer + step)[:, None] for step in range(3))
    corner, side = quads[:, :4], quads[:, 4:]
    return np.concatenate(
        [corner + low, corner + high, side + low, side + high, corner + middle], axis=1
    )


def _levels(design: Design, stack: list[tuple[str, float]]) -> Array:
    """Height (mm) of every level: the layers' ends and their middles."""
    ends = np.concatenate([[0.0], np.cumsum([thickness for _, thickness in stack])])
    levels = np.empty(2 * len(stack) + 1)
    levels[::2] = ends - design.plate_thickness
    levels[1::2] = 0.5 * (levels[:-1:2] + levels[2::2])
    return levels


def _node_positions(points: Array, levels: Array) -> Array:
    flat = np.tile(points, (len(levels), 1))
    return np.column_stack([flat, np.repeat(levels, len(points))])


def _parts(kind: NDArray[np.str_], region: Indices, chamber: Indices) -> dict[str, Indices]:
    """The stiff part (plates and discs) and the three walls, each with its own orientation."""
    soft = (kind != PLATE) & (region == WALL)
    parts = {f"WALL{i + 1}": np.flatnonzero(soft & (chamber == i)) for i in range(3)}
    return {"STIFF": np.flatnonzero(~soft), **parts}


def _rings(
    corners: Indices, wall: NDArray[np.bool_], chamber: Indices, new: Indices, n: int
) -> Indices:
    """Nodes of every chamber's wall in every level from cap to cap."""
    levels = np.arange(2, len(new) // n - 2)
    points = np.stack([np.unique(corners[wall & (chamber == i)]) for i in range(3)])
    return np.asarray(new[levels[None, :, None] * n + points[:, None, :]])

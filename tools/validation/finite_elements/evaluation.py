"""From displacements to the error of the inverse kinematics, in percent per chamber.

In: the solved positions of all nodes. Out: the tip plate's pose, the chambers' centre-line lengths
in the solution, and the lengths that this project's inverse kinematics gives for that tip.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pneuarm.controllers.arm.arm import CHAMBER_ANGLES_RAD
from pneuarm.controllers.kinematics.constant_curvature import (
    lengths_from_shapes,
    section_inverse,
    section_transforms,
)
from tools.validation.finite_elements.design import Design
from tools.validation.finite_elements.mesh import Mesh

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Comparison:
    """One solved state: lengths and positions in mm, angles in degrees, errors in percent.

    ``error_percent`` is (inverse kinematics - solution) / solution for every chamber;
    ``tip_turn_deg`` is the rotation between the solved tip plate and the end of the arc;
    ``plate_misfit`` is the largest distance of a node of the tip plate from its rigid fit;
    ``line_deviation`` that of every chamber's centre line from the arc the model puts it on.
    """

    tip_position: Array
    bend_deg: float
    lengths_solved: Array
    lengths_inverse: Array
    error_percent: Array
    tip_turn_deg: float
    plate_misfit: float
    line_deviation: Array


def compare(design: Design, mesh: Mesh, displacements: Array) -> Comparison:
    """Evaluate one solved state; ``displacements`` is ``(nodes, 3)`` in mm."""
    solved_nodes = mesh.nodes + displacements
    rotation, shift = rigid_fit(mesh.nodes[mesh.tip_nodes], solved_nodes[mesh.tip_nodes])
    tip = rotation @ [0.0, 0.0, design.rest_length] + shift
    fitted = mesh.nodes[mesh.tip_nodes] @ rotation.T + shift
    shape = section_inverse(tip)
    inverse = lengths_from_shapes(shape, design.chamber_offset)
    lines = centre_lines(mesh, solved_nodes)
    solved = curve_lengths(lines)
    arc_rotation = section_transforms(shape)[:3, :3]
    return Comparison(
        tip_position=tip,
        bend_deg=float(np.rad2deg(np.hypot(shape[1], shape[2]))),
        lengths_solved=solved,
        lengths_inverse=inverse,
        error_percent=100.0 * (inverse - solved) / solved,
        tip_turn_deg=float(np.rad2deg(rotation_angle(arc_rotation.T @ rotation))),
        plate_misfit=float(np.max(np.linalg.norm(fitted - solved_nodes[mesh.tip_nodes], axis=1))),
        line_deviation=line_deviations(lines, model_lines(shape, design.chamber_offset)),
    )


def rigid_fit(before: Array, after: Array) -> tuple[Array, Array]:
    """Rotation (3, 3) and shift (3,) that carry ``before`` onto ``after`` (n, 3) best.

    Least squares by the singular value decomposition (Kabsch, Acta Cryst. A32, 1976).
    """
    centre, moved = before.mean(axis=0), after.mean(axis=0)
    left, _, right = np.linalg.svd((after - moved).T @ (before - centre))
    handed = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation = left @ handed @ right
    return rotation, moved - rotation @ centre


def centre_lines(mesh: Mesh, nodes: Array) -> Array:
    """Middle of every chamber's wall in every level, ``(3, levels, 3)``, cap to cap."""
    return np.asarray(nodes[mesh.rings].mean(axis=2))


def curve_lengths(lines: Array) -> Array:
    """Lengths ``(3,)`` of curves through ``(3, levels, 3)``, every second a middle of elements.

    Chords are too short by the square of their length, so that those of half and of whole elements
    extrapolate to the curve (Richardson).
    """
    halves = np.linalg.norm(np.diff(lines, axis=1), axis=2).sum(axis=1)
    wholes = np.linalg.norm(np.diff(lines[:, ::2], axis=1), axis=2).sum(axis=1)
    return np.asarray((4.0 * halves - wholes) / 3.0)


def model_lines(shape: Array, offset: float) -> Array:
    """The chambers' arcs in the model, ``(3, 401, 3)`` in mm, for a shape ``(L, u, v)``."""
    frames = section_transforms(np.linspace(0.0, 1.0, 401)[:, None] * shape)
    around = offset * np.stack(
        [np.cos(CHAMBER_ANGLES_RAD), np.sin(CHAMBER_ANGLES_RAD), np.zeros(3)], axis=-1
    )
    return np.asarray(frames[:, :3, 3] + np.einsum("sij,cj->csi", frames[:, :3, :3], around))


def line_deviations(lines: Array, arcs: Array) -> Array:
    """Largest distance (mm) of the points of each line to its arc, a fine polyline, ``(3,)``."""
    start, step = arcs[:, None, :-1], np.diff(arcs, axis=1)[:, None]
    away = lines[:, :, None] - start
    share = np.clip(np.sum(away * step, axis=-1) / np.sum(step * step, axis=-1), 0.0, 1.0)
    distance = np.linalg.norm(away - share[..., None] * step, axis=-1)
    return np.asarray(distance.min(axis=2).max(axis=1))


def rotation_angle(rotation: Array) -> float:
    """Angle (rad) of a rotation matrix, exact also near zero."""
    sine = 0.5 * np.linalg.norm(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    return float(np.arctan2(sine, 0.5 * (np.trace(rotation) - 1.0)))

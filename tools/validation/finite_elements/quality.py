"""Jacobian determinants and volumes of twenty-node hexahedra: is the mesh valid?"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Natural coordinates of the nodes in CalculiX's (and Abaqus's) order.
_CORNERS = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
_SIDES = [(0, -1), (1, 0), (0, 1), (-1, 0)]
_NATURAL = np.array(
    [(*at, z) for z in (-1, 1) for at in _CORNERS]
    + [(*at, z) for z in (-1, 1) for at in _SIDES]
    + [(*at, 0) for at in _CORNERS],
    dtype=np.float64,
)


def shape_functions(point: Array) -> Array:
    """The twenty serendipity shape functions at natural coordinates ``(3,)``, ``(20,)``."""
    factors = 1.0 + point * _NATURAL
    corner = np.prod(factors, axis=1) * (np.sum(point * _NATURAL, axis=1) - 2.0) / 8.0
    middle = _NATURAL == 0.0
    side = np.prod(np.where(middle, 1.0 - point**2, factors), axis=1) / 4.0
    return np.asarray(np.where(middle.any(axis=1), side, corner))


def shape_gradients(point: Array) -> Array:
    """Their derivatives ``(20, 3)``, by central differences (exact to 1e-9 for cubics)."""
    step = 1e-4
    moves = step * np.eye(3)
    columns = [shape_functions(point + m) - shape_functions(point - m) for m in moves]
    return np.stack(columns, axis=1) / (2.0 * step)


def jacobians(nodes: Array, hexes: NDArray[np.int64]) -> Array:
    """Determinants (mm^3) at the 3x3x3 Gauss points, ``(elements, 27)``."""
    gradients = np.stack([shape_gradients(point) for point in _gauss()[0]])
    return np.asarray(np.linalg.det(np.einsum("eni,gnj->egij", nodes[hexes], gradients)))


def volumes(nodes: Array, hexes: NDArray[np.int64]) -> Array:
    """Volume (mm^3) of every element."""
    return np.asarray(jacobians(nodes, hexes) @ _gauss()[1])


def _gauss() -> tuple[Array, Array]:
    at, weight = np.polynomial.legendre.leggauss(3)
    points = np.stack(np.meshgrid(at, at, at, indexing="ij"), axis=-1).reshape(-1, 3)
    return points, np.einsum("i,j,k->ijk", weight, weight, weight).ravel()

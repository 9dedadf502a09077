"""How far a section may bend."""

import numpy as np

from controllers.arm import Arm, Array
from controllers.kinematics.constant_curvature import lengths_from_shapes, shapes_from_lengths

#: Below this bend times d (m) the arm counts as straight, and any direction is tangent.
_STRAIGHT_M = 1e-10
_ANY_DIRECTION = np.array([1.0, 0.0])

#: Far below any length that matters; keeps a division defined and a comparison safe.
_TINY_M = 1e-12


class BendLimit:
    """Keeps the bending angle of every section within ``bend_max_rad``.

    The limit is a cone around the straight arm. Its rows are the tangent in the present direction
    of bending, which a step along the cone leaves at second order: :meth:`clip` is exact.
    """

    def __init__(self, arm: Arm) -> None:
        self.bend_max_rad = arm.per_section("bend_max_rad").reshape(-1)
        self._offset_m = arm.per_section("chamber_offset_m")
        self.pattern: Array = np.repeat(np.eye(arm.n_sections), 3, axis=1)
        # d times the derivative of (u, v) over a section's three lengths: the rows are in metres.
        self._gradient = shapes_from_lengths(np.eye(3), 1.0)[:, 1:].T
        self._largest_m = self._offset_m * self.bend_max_rad[:, None]
        self._lower = np.full(arm.n_sections, -np.inf)

    def _bends(self, lengths_m: Array) -> tuple[Array, Array]:
        """Bending vectors times d (n_sections, 2) and their norms (n_sections, 1), both in m."""
        vectors = lengths_m @ self._gradient.T
        return vectors, np.sqrt(np.add.reduce(vectors * vectors, axis=1, keepdims=True))

    def rows(self, lengths_m: Array, dt_s: float) -> tuple[Array, Array, Array]:
        """One row a section: how fast the bend grows, at most what is left, both times d (m)."""
        vectors, norms = self._bends(lengths_m)
        directions = np.where(norms < _STRAIGHT_M, _ANY_DIRECTION, vectors / (norms + _TINY_M))
        rows = self.pattern * (directions @ self._gradient).reshape(1, -1)
        return rows, self._lower, (self._largest_m - norms)[:, 0]

    def slack_m(self, lengths_m: Array) -> Array:
        """What is left of the bend, times d (m), for every section (n_sections,)."""
        slack: Array = (self._largest_m - self._bends(lengths_m)[1])[:, 0]
        return slack

    def clip(self, lengths_m: Array) -> Array:
        """Unbend the sections that are beyond the limit, at constant arc length.

        A length moves toward the mean of its section, so bounds that held before hold after.
        """
        if (self._bends(lengths_m)[1] <= self._largest_m - _TINY_M).all():
            return lengths_m
        shapes = shapes_from_lengths(lengths_m, self._offset_m)
        theta = np.sqrt(shapes[:, 1] ** 2 + shapes[:, 2] ** 2)
        excess = theta > self.bend_max_rad
        factor = np.where(excess, self.bend_max_rad / np.where(excess, theta, 1.0), 1.0)
        shapes[:, 1:] *= factor[:, None]
        return np.where(excess[:, None], lengths_from_shapes(shapes, self._offset_m), lengths_m)

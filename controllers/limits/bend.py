"""How far a section may bend."""

import casadi as ca
import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.constant_curvature import (
    lengths_from_shapes,
    shapes_from_lengths,
)
from pneuarm.controllers.limits.limit import Limit

#: Far below any length that matters; keeps a division defined and a comparison safe.
_TINY_M = 1e-12


class BendLimit(Limit):
    """Keeps the bending angle of every section within ``bend_max_rad``.

    The limit is a cone around the straight arm, which a step along it leaves at second order: so
    the QP leaves a margin.
    """

    name, bit = "bend", 2
    margin_m = 2e-6
    convex = in_workspace = True

    def __init__(self, arm: Arm) -> None:
        super().__init__(arm)
        self._bend_max_rad = arm.per_section("bend_max_rad")[:, 0]
        self._offset_m = arm.per_section("chamber_offset_m")
        # d times the derivative of (u, v) over a section's three lengths: the rows are in metres.
        self._gradient = shapes_from_lengths(np.eye(3), 1.0)[:, 1:].T
        self._largest_m = self._offset_m[:, 0] * self._bend_max_rad

    def slack(self, lengths: ca.SX) -> ca.SX:
        """What is left of every section's bend, times d."""
        vectors = ca.DM(self._gradient) @ ca.reshape(lengths, 3, -1)
        norms = ca.sqrt(ca.sum1(vectors * vectors) + _TINY_M**2)  # smooth at the straight arm
        return ca.DM(self._largest_m) - norms.T

    def clip(self, lengths_m: Array) -> Array:
        """Unbend the sections that are beyond the limit, at constant arc length.

        A length moves toward the mean of its section, so bounds that held before hold after.
        """
        vectors = lengths_m @ self._gradient.T
        bends = np.sqrt(np.add.reduce(vectors * vectors, axis=1))
        if (bends <= self._largest_m - _TINY_M).all():
            return lengths_m
        shapes = shapes_from_lengths(lengths_m, self._offset_m)
        theta = np.sqrt(shapes[:, 1] ** 2 + shapes[:, 2] ** 2)
        shapes[:, 1:] *= (self._bend_max_rad / np.maximum(theta, self._bend_max_rad))[:, None]
        excess = theta[:, None] > self._bend_max_rad[:, None]
        return np.where(excess, lengths_from_shapes(shapes, self._offset_m), lengths_m)

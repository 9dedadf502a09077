"""Chamber pressure <-> chamber length, through the calibrated map of each section.

The lengthening of a chamber over gauge pressure p is ``a p + b p |p|``: two coefficients, odd in
p, so that one map serves chambers that lengthen under pressure and shorten under vacuum. With
``b > 0`` the chamber gets softer as it fills, as table 1 of the paper shows.
"""

import casadi as ca
import numpy as np

from controllers.arm import LENGTH_MARGIN_M, Arm, Array


class PressureMap:
    """The map of a whole arm; arrays of shape ``(n_sections, 3)``, or a batch ``(..., n, 3)``."""

    def __init__(self, arm: Arm) -> None:
        self._rest_m = arm.rest_lengths_m
        self._linear = arm.per_chamber("lengthening_m_per_pa")
        self._quadratic = arm.per_chamber("softening_m_per_pa2")

    def lengths_m(self, pressures_pa: Array) -> Array:
        """Lengths of unloaded chambers at the given gauge pressures."""
        return self._rest_m + pressures_pa * (self._linear + self._quadratic * np.abs(pressures_pa))

    def pressures_pa(self, lengths_m: Array) -> Array:
        """Gauge pressures that give the lengths; the exact inverse of :meth:`lengths_m`."""
        lengthening = lengths_m - self._rest_m
        root = np.sqrt(self._linear**2 + 4.0 * self._quadratic * np.abs(lengthening))
        return 2.0 * lengthening / (self._linear + root)


def symbolic_pressures(arm: Arm, lengths: ca.SX) -> ca.SX:
    """Gauge pressures (n_chambers,) of lengths in C order: :class:`PressureMap` in symbols."""
    lengthening = lengths - ca.DM(arm.rest_lengths_m.reshape(-1))
    linear = ca.DM(arm.per_chamber("lengthening_m_per_pa").reshape(-1))
    quadratic = ca.DM(arm.per_chamber("softening_m_per_pa2").reshape(-1))
    root = ca.sqrt(linear**2 + 4.0 * quadratic * ca.fabs(lengthening))
    return 2.0 * lengthening / (linear + root)


def pressure_length_bounds_m(arm: Arm) -> tuple[Array, Array]:
    """Lengths at the pressure limits, lower and upper, each ``(n_sections, 3)``."""
    pressure_map = PressureMap(arm)
    return (
        pressure_map.lengths_m(arm.per_chamber("pressure_min_pa")),
        pressure_map.lengths_m(arm.per_chamber("pressure_max_pa")),
    )


def length_bounds_m(arm: Arm) -> tuple[Array, Array]:
    """Lengths that may be commanded: inside Eq. (4) and inside the pressure range.

    Returns the lower and the upper bound, each ``(n_sections, 3)``, strictly inside the open
    interval of Eq. (4) by LENGTH_MARGIN_M.
    """
    pressure_low, pressure_high = pressure_length_bounds_m(arm)
    low = np.maximum(arm.per_chamber("length_min_m") + LENGTH_MARGIN_M, pressure_low)
    high = np.minimum(arm.per_chamber("length_max_m") - LENGTH_MARGIN_M, pressure_high)
    return low, high

"""How long a chamber may be: Eq. (4), ``l0/2 < l < 3 l0/2``, and what the pressures reach.

The ends of Eq. (4) are the section's ``length_min_m`` and ``length_max_m``, from the configuration.
"""

import casadi as ca
import numpy as np

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.limits.limit import Limit, column


class LengthLimit(Limit):
    """Keeps every length inside the open interval of Eq. (4), and inside the pressures' reach."""

    name, bit = "length", 1
    words = "length, Eq. (4)"
    margin_m = 1e-7
    convex = two_sided = in_workspace = True

    def __init__(self, arm: Arm) -> None:
        super().__init__(arm)
        self._lower_m, self._upper_m = length_bounds_m(arm)
        self._shortest_m, self._longest_m = arm.length_interval_m

    def slack(self, lengths: ca.SX) -> ca.SX:
        """Distances to the lower bounds, then to the upper ones."""
        low, high = column(self._lower_m), column(self._upper_m)
        return ca.vertcat(lengths - low, high - lengths)

    def clip(self, lengths_m: Array) -> Array:
        """Nearest lengths that respect the bounds."""
        return np.minimum(np.maximum(lengths_m, self._lower_m), self._upper_m)

    def stops(self, lengths_m: Array) -> bool:
        """Whether a length is at an end of Eq. (4); at the pressure's, the pressure says so."""
        left = np.minimum(lengths_m - self._shortest_m, self._longest_m - lengths_m)
        return bool((left < self.at_bound_m).any())

    def contradiction(self) -> str:
        """Whether Eq. (4) and the pressure range leave no length; the rest length is in both."""
        low, high = self._lower_m, self._upper_m
        if (low < high).all():
            return ""
        section, chamber = np.argwhere(low >= high)[0]
        return (
            f"section {section + 1}, chamber {chamber + 1}: the pressure range and the interval of "
            f"lengths leave no length; it would lie between {1e3 * low[section, chamber]:.4g} and "
            f"{1e3 * high[section, chamber]:.4g} mm"
        )

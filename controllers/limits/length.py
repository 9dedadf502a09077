"""Chamber lengths inside Eq. (4) and inside what the pressure range can reach."""

import casadi as ca
import numpy as np

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array


class LengthLimit:
    """Keeps every length strictly inside the open interval of Eq. (4)."""

    margin_m = 1e-7

    def __init__(self, arm: Arm) -> None:
        self.lower_m, self.upper_m = length_bounds_m(arm)

    def slack(self, lengths: ca.SX) -> ca.SX:
        """Distances to the lower bounds, then to the upper ones."""
        low, high = ca.DM(self.lower_m.reshape(-1)), ca.DM(self.upper_m.reshape(-1))
        return ca.vertcat(lengths - low, high - lengths)

    def clip(self, lengths_m: Array) -> Array:
        """Nearest lengths that respect the bounds."""
        return np.minimum(np.maximum(lengths_m, self.lower_m), self.upper_m)

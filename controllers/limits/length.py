"""Chamber lengths inside Eq. (4) and inside what the pressure range can reach."""

import numpy as np

from controllers.actuation import length_bounds_m
from controllers.arm import Arm, Array


class LengthLimit:
    """Keeps every length strictly inside the open interval of Eq. (4)."""

    def __init__(self, arm: Arm) -> None:
        self.lower_m, self.upper_m = length_bounds_m(arm)
        self.pattern: Array = np.eye(arm.n_chambers)

    def rows(self, lengths_m: Array, dt_s: float) -> tuple[Array, Array, Array]:
        """Identity rows: the step may go as far as the bound."""
        return (
            self.pattern,
            (self.lower_m - lengths_m).reshape(-1),
            (self.upper_m - lengths_m).reshape(-1),
        )

    def clip(self, lengths_m: Array) -> Array:
        """Nearest lengths that respect the bounds."""
        return np.minimum(np.maximum(lengths_m, self.lower_m), self.upper_m)

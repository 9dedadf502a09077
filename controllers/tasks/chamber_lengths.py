"""The chambers at given lengths."""

from dataclasses import dataclass

import numpy as np

from controllers.arm import Array
from controllers.kinematics.compiled import TipState


@dataclass(frozen=True)
class ChamberLengths:
    """Bring the chambers to ``lengths_m`` (n_sections, 3); the law limits the rate."""

    lengths_m: Array
    gain_per_s: float

    def rate_and_jacobian(self, tip: TipState, lengths_m: Array) -> tuple[Array, Array]:
        """One row a chamber, the identity as the Jacobian."""
        rate = self.gain_per_s * (self.lengths_m - lengths_m).reshape(-1)
        return rate, np.eye(rate.size)

    def error_m(self, tip: TipState, lengths_m: Array) -> float:
        """Largest distance of a chamber from its length."""
        return float(np.abs(self.lengths_m - lengths_m).max())

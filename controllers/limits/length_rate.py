"""How fast a chamber may change its length."""

import numpy as np

from controllers.arm import Arm, Array


class LengthRateLimit:
    """Keeps every step within ``length_rate_max_m_s``."""

    def __init__(self, arm: Arm) -> None:
        self.rate_max_m_s = arm.per_chamber("length_rate_max_m_s").reshape(-1)
        self.pattern: Array = np.eye(arm.n_chambers)

    def rows(self, lengths_m: Array, dt_s: float) -> tuple[Array, Array, Array]:
        """Identity rows: at most the rate times the duration of the step, both ways."""
        largest = self.rate_max_m_s * dt_s
        return self.pattern, -largest, largest

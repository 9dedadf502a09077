"""How the commanded arm stands to its target: on the way, there, or out of reach."""

from enum import IntEnum

import numpy as np


class Reach(IntEnum):
    """How the commanded arm stands to its target, numbered as on the wire."""

    NONE = 0
    MOVING = 1
    REACHED = 2
    OUT_OF_REACH = 3


class Progress:
    """Judges a target by how its error goes down.

    Reached is what has been within the tolerance for a while: the air follows with a lag. Out of
    reach is what has not come nearer for a while, whatever the chambers do meanwhile.
    """

    def __init__(
        self, tolerance_m: float, settled_s: float, least_rate_m_s: float, stalled_s: float
    ) -> None:
        self._tolerance_m, self._settled_s = tolerance_m, settled_s
        self._least_m, self._stalled_s = least_rate_m_s * stalled_s, stalled_s
        self.start()

    def start(self) -> None:
        """Forget what was seen."""
        self._near_s = self._still_s = 0.0
        self._best_m = np.inf

    def judge(self, error_m: float, dt_s: float) -> Reach:
        """Say how it stands after another ``dt_s`` with this error."""
        if error_m <= self._tolerance_m:
            self._near_s, self._still_s = self._near_s + dt_s, 0.0
            return Reach.REACHED if self._near_s >= self._settled_s else Reach.MOVING
        self._near_s = 0.0
        self._still_s += dt_s
        if self._best_m == np.inf:
            self._best_m = error_m
        elif self._best_m - error_m >= min(self._least_m, 0.5 * self._best_m):
            self._best_m, self._still_s = error_m, 0.0
        return Reach.OUT_OF_REACH if self._still_s >= self._stalled_s else Reach.MOVING

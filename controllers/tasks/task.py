"""What every task gives to a law, and the helpers the tasks share."""

from typing import Protocol

import numpy as np

from controllers.arm import Array
from controllers.kinematics.compiled import TipState


class Task(Protocol):
    """A wanted rate of some quantity and that quantity's Jacobian over the chamber lengths."""

    def rate_and_jacobian(self, tip: TipState, lengths_m: Array) -> tuple[Array, Array]:
        """Return the wanted rate (m,) in m/s and the Jacobian (m, n_chambers)."""
        ...

    def error_m(self, tip: TipState, lengths_m: Array) -> float:
        """Return how far (m) the task is from done; 0 for a task that has no end."""
        ...


def limited(vector: Array, largest: float) -> Array:
    """Scale a vector down to the norm ``largest``, keeping its direction."""
    norm = float(np.sqrt(vector @ vector))
    return vector if norm <= largest else vector * (largest / norm)

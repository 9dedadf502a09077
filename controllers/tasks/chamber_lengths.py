"""The chambers at given lengths, and the posture."""

from dataclasses import dataclass

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.tasks.wanted import Wanted


@dataclass(frozen=True)
class ChamberLengths:
    """Bring the chambers to ``lengths_m`` (n_sections, 3); the limits say how fast."""

    lengths_m: Array
    weight: float = 1.0

    def write(self, wanted: Wanted) -> None:
        """One row a chamber, the identity as the Jacobian."""
        wanted["lengths_m"], wanted["lengths_weight"] = self.lengths_m, self.weight


@dataclass(frozen=True)
class Posture:
    """Stay near the middle of the bounds, with the freedoms that the other tasks leave.

    It works in the null space of the others, so it costs them nothing; ``weight`` is a speed: with
    1 a chamber at its bound goes back at a quarter of its largest rate.
    """

    weight: float = 1.0

    def write(self, wanted: Wanted) -> None:
        """No row of its own."""
        wanted["posture_weight"] = self.weight

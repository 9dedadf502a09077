"""The chambers at given lengths or pressures, and the posture."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.targets import checks
from pneuarm.controllers.targets.target import LawName, Target
from pneuarm.controllers.tasks.wanted import Wanted


@dataclass(frozen=True)
class LengthsTarget(Target):
    """Chambers at ``lengths_m`` (n_sections, 3); the limits say how fast."""

    name, kind = "lengths", 4

    lengths_m: Array
    law: LawName = LawName.DEFAULT
    weight: float = 1.0

    @classmethod
    def checked(cls, fields: checks.Fields, allowed: checks.Allowed, law: LawName) -> Self:
        """A length a chamber, inside Eq. (4) and the pressure range."""
        return cls(allowed.chambers(fields, "length_m", "m", allowed.lengths_m), law)

    def write(self, wanted: Wanted) -> None:
        """One row a chamber, the identity as the Jacobian."""
        wanted["lengths_m"], wanted["lengths_weight"] = self.lengths_m, self.weight

    def weighted(self, weight: float, orientation_weight: float) -> "LengthsTarget":
        """One weight for all chambers."""
        return replace(self, weight=weight)


@dataclass(frozen=True)
class PressuresTarget(Target):
    """Chambers at gauge ``pressures_pa`` (n_sections, 3), through the map and the same limits."""

    name, kind = "pressures", 5
    sends_pressures = True

    pressures_pa: Array
    law: LawName = LawName.DEFAULT

    @classmethod
    def checked(cls, fields: checks.Fields, allowed: checks.Allowed, law: LawName) -> Self:
        """A pressure a chamber, inside its range."""
        return cls(allowed.chambers(fields, "pressure_pa", "Pa", allowed.pressures_pa), law)

    def in_lengths(self, lengths_of: Callable[[Array], Array]) -> Target:
        """Return the lengths that the pressures give."""
        return LengthsTarget(lengths_of(self.pressures_pa), self.law)

    def write(self, wanted: Wanted) -> None:
        """Refuse: the law knows lengths, see :meth:`in_lengths`."""
        raise NotImplementedError


@dataclass(frozen=True)
class PostureTarget(Target):
    """Stay near the middle of the bounds, with the freedoms that the other tasks leave.

    It works in the null space of the others, so it costs them nothing; ``weight`` is a speed: with
    1 a chamber at its bound goes back at a quarter of its largest rate. Only among other tasks.
    """

    name, kind, alone = "posture", 0, False

    law: LawName = LawName.DEFAULT
    weight: float = 1.0

    @classmethod
    def checked(cls, fields: checks.Fields, allowed: checks.Allowed, law: LawName) -> Self:
        """Nothing to check."""
        return cls(law)

    def write(self, wanted: Wanted) -> None:
        """No row of its own."""
        wanted["posture_weight"] = self.weight

    def weighted(self, weight: float, orientation_weight: float) -> "PostureTarget":
        """How fast the posture is taken."""
        return replace(self, weight=weight)

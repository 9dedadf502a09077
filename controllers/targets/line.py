"""The tip on a line, there and back."""

import math
from dataclasses import dataclass, field
from typing import Self

from pneuarm.controllers.geometry.moving_point import MovingPoint
from pneuarm.controllers.targets import checks
from pneuarm.controllers.targets.shape import ShapeTarget, triple
from pneuarm.controllers.targets.target import LawName


@dataclass(frozen=True)
class LineTarget(ShapeTarget):
    """From ``start_m`` to ``end_m`` and back in ``period_s``, harmonically, so many times."""

    name, kind = "line", 12

    start_m: tuple[float, ...]
    end_m: tuple[float, ...]
    period_s: float
    repeats: float = math.inf
    id: int = 0
    law: LawName = field(default=LawName.DEFAULT, compare=False)

    @classmethod
    def checked(cls, fields: checks.Fields, allowed: checks.Allowed, law: LawName) -> Self:
        """Two ends in the base frame, and a time."""
        return cls(
            triple(allowed.position(fields, "start_m")),
            triple(allowed.position(fields, "end_m")),
            checks.positive(fields, "period_s"),
            checks.times(fields, "repeats"),
            fields["id"],
            law,
        )

    @property
    def span_s(self) -> float:
        """One way there and back."""
        return self.period_s

    @property
    def duration_s(self) -> float:
        """All ways there and back."""
        return self.repeats * self.period_s

    def at(self, time_s: float) -> MovingPoint:
        """``start + (end - start) (1 - cos) / 2``."""
        rate = 2.0 * math.pi / self.period_s
        cosine, sine = math.cos(rate * time_s), math.sin(rate * time_s)
        way = [b - a for a, b in zip(self.start_m, self.end_m, strict=True)]
        return MovingPoint(
            [a + 0.5 * (1.0 - cosine) * w for a, w in zip(self.start_m, way, strict=True)],
            [0.5 * rate * sine * w for w in way],
            [0.5 * rate * rate * cosine * w for w in way],
        )

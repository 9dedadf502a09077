"""The tip on a circle."""

import math
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from pneuarm.controllers.geometry.moving_point import MovingPoint
from pneuarm.controllers.targets import checks
from pneuarm.controllers.targets.shape import ShapeTarget, perpendicular, triple
from pneuarm.controllers.targets.target import LawName


@dataclass(frozen=True)
class CircleTarget(ShapeTarget):
    """Round ``center_m`` with ``radius_m`` in the plane of two unit vectors.

    It starts at the first vector, goes toward the second, and ends after ``turns``.
    """

    name, kind = "circle", 11

    center_m: tuple[float, ...]
    first: tuple[float, ...]
    second: tuple[float, ...]
    radius_m: float
    frequency_hz: float
    turns: float = math.inf
    id: int = 0
    law: LawName = field(default=LawName.DEFAULT, compare=False)

    @classmethod
    def checked(cls, fields: checks.Fields, allowed: checks.Allowed, law: LawName) -> Self:
        """A centre in the base frame, a plane, a size and a speed."""
        center = allowed.position(fields, "center_m")
        normal = np.array([0.0, 0.0, 1.0])
        if fields["normal"] is not None:
            normal = checks.unit_vector(fields, "normal")
        first, second = perpendicular(normal)
        return cls(
            triple(center),
            triple(first),
            triple(second),
            checks.positive(fields, "radius_m"),
            checks.positive(fields, "frequency_hz"),
            checks.times(fields, "turns"),
            fields["id"],
            law,
        )

    @property
    def span_s(self) -> float:
        """One turn."""
        return 1.0 / self.frequency_hz

    @property
    def duration_s(self) -> float:
        """Turns over frequency."""
        return self.turns / self.frequency_hz

    def at(self, time_s: float) -> MovingPoint:
        """Uniform motion on the circle."""
        rate = 2.0 * math.pi * self.frequency_hz
        angle = rate * time_s
        cosine, sine = self.radius_m * math.cos(angle), self.radius_m * math.sin(angle)
        out = [cosine * a + sine * b for a, b in zip(self.first, self.second, strict=True)]
        along = [cosine * b - sine * a for a, b in zip(self.first, self.second, strict=True)]
        return MovingPoint(
            [c + o for c, o in zip(self.center_m, out, strict=True)],
            [rate * value for value in along],
            [-rate * rate * value for value in out],
        )

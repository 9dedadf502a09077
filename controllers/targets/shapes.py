"""Ready motions of the tip over their own time: circle, line there and back, timed waypoints.

All run for ever smoothly: position, velocity and acceleration are continuous from the first second
to the last. ``key`` tells a repetition of the same shape from a new one.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.interpolate import CubicSpline

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.reference.trajectory import Motion

_ZERO = [0.0, 0.0, 0.0]


class Shape(Protocol):
    """A motion from 0 to ``duration_s``, which may be infinite."""

    @property
    def duration_s(self) -> float:
        """When it is over."""
        ...

    def at(self, time_s: float) -> Motion:
        """Where the tip is at a time; before the start and after the end it stands."""
        ...


def perpendicular(normal: Array) -> tuple[Array, Array]:
    """Two unit vectors that make a right-handed frame with a normal (3,) of any length.

    The first is base x as far as it lies in the plane; base y where the normal is along x.
    """
    unit = normal / np.linalg.norm(normal)
    axis = np.array([1.0, 0.0, 0.0] if abs(unit[0]) < 0.9 else [0.0, 1.0, 0.0])
    first = axis - (axis @ unit) * unit
    first /= np.linalg.norm(first)
    return first, np.cross(unit, first)


@dataclass(frozen=True)
class Circle:
    """Round ``center_m`` with ``radius_m`` in the plane of two unit vectors.

    It starts at the first vector, goes toward the second, and ends after ``turns``.
    """

    center_m: tuple[float, ...]
    first: tuple[float, ...]
    second: tuple[float, ...]
    radius_m: float
    frequency_hz: float
    turns: float = math.inf

    @property
    def duration_s(self) -> float:
        """Turns over frequency."""
        return self.turns / self.frequency_hz

    def at(self, time_s: float) -> Motion:
        """Uniform motion on the circle."""
        rate = 2.0 * math.pi * self.frequency_hz
        angle = rate * time_s
        cosine, sine = self.radius_m * math.cos(angle), self.radius_m * math.sin(angle)
        out = [cosine * a + sine * b for a, b in zip(self.first, self.second, strict=True)]
        along = [cosine * b - sine * a for a, b in zip(self.first, self.second, strict=True)]
        return Motion(
            [c + o for c, o in zip(self.center_m, out, strict=True)],
            [rate * value for value in along],
            [-rate * rate * value for value in out],
        )


@dataclass(frozen=True)
class Line:
    """From ``start_m`` to ``end_m`` and back in ``period_s``, harmonically, so many times."""

    start_m: tuple[float, ...]
    end_m: tuple[float, ...]
    period_s: float
    repeats: float = math.inf

    @property
    def duration_s(self) -> float:
        """All ways there and back."""
        return self.repeats * self.period_s

    def at(self, time_s: float) -> Motion:
        """``start + (end - start) (1 - cos) / 2``."""
        rate = 2.0 * math.pi / self.period_s
        cosine, sine = math.cos(rate * time_s), math.sin(rate * time_s)
        way = [b - a for a, b in zip(self.start_m, self.end_m, strict=True)]
        return Motion(
            [a + 0.5 * (1.0 - cosine) * w for a, w in zip(self.start_m, way, strict=True)],
            [0.5 * rate * sine * w for w in way],
            [0.5 * rate * rate * cosine * w for w in way],
        )


@dataclass(frozen=True)
class Waypoints:
    """Through ``positions_m`` (n, 3) at ``times_s`` (n,), at rest at the first and the last.

    Quintics between the points, with the velocities and accelerations of the clamped cubic spline
    inside and none at the ends: continuous in acceleration, bounded in jerk.
    """

    times_s: tuple[float, ...]
    positions_m: tuple[tuple[float, float, float], ...]
    _pieces: list[list[list[float]]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Find the coefficients of every piece."""
        times, points = np.array(self.times_s), np.array(self.positions_m)
        spline = CubicSpline(times, points, bc_type="clamped")
        velocities, accelerations = spline(times, 1), spline(times, 2)
        velocities[[0, -1]] = accelerations[[0, -1]] = 0.0
        pieces = [
            _quintic(points[i : i + 2], velocities[i : i + 2], accelerations[i : i + 2], span)
            for i, span in enumerate(np.diff(times).tolist())
        ]
        object.__setattr__(self, "_pieces", pieces)

    @property
    def duration_s(self) -> float:
        """Time of the last point."""
        return self.times_s[-1]

    def at(self, time_s: float) -> Motion:
        """Position, velocity and acceleration; the first point before its time."""
        if time_s <= self.times_s[0]:
            return Motion(list(self.positions_m[0]), _ZERO, _ZERO)
        if time_s >= self.times_s[-1]:
            return Motion(list(self.positions_m[-1]), _ZERO, _ZERO)
        index = bisect_right(self.times_s, time_s) - 1
        t = time_s - self.times_s[index]
        position, velocity, acceleration = [], [], []
        for a, b, c, d, e, f in self._pieces[index]:
            position.append(a + t * (b + t * (c + t * (d + t * (e + t * f)))))
            velocity.append(b + t * (2 * c + t * (3 * d + t * (4 * e + t * 5 * f))))
            acceleration.append(2 * c + t * (6 * d + t * (12 * e + t * 20 * f)))
        return Motion(position, velocity, acceleration)


def _quintic(points: Array, rates: Array, seconds: Array, span_s: float) -> list[list[float]]:
    """Coefficients (3, 6), lowest power first, between two states a span apart."""
    a, b, c = points[0], rates[0], 0.5 * seconds[0]
    h = span_s
    rise = points[1] - (a + h * (b + h * c))
    speed = h * (rates[1] - (b + 2.0 * h * c))
    curve = h * h * (seconds[1] - 2.0 * c)
    d = (10.0 * rise - 4.0 * speed + 0.5 * curve) / h**3
    e = (-15.0 * rise + 7.0 * speed - curve) / h**4
    f = (6.0 * rise - 3.0 * speed + 0.5 * curve) / h**5
    coefficients: list[list[float]] = np.stack([a, b, c, d, e, f], axis=1).tolist()
    return coefficients

"""The tip through timed waypoints."""

import math
from bisect import bisect_right
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Self

import numpy as np
from scipy.interpolate import CubicSpline

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import TargetRejected
from pneuarm.controllers.geometry.moving_point import MovingPoint
from pneuarm.controllers.targets import checks
from pneuarm.controllers.targets.shape import SAMPLES, ShapeTarget, Triple, triple
from pneuarm.controllers.targets.target import LawName

MAX_WAYPOINTS = 200
_SHORTEST_S = 0.01
_LONGEST_S = 3600.0

#: A quintic has no more extremes of its speed and acceleration than these show.
_PIECE_SAMPLES = 12

_ZERO = [0.0, 0.0, 0.0]


@dataclass(frozen=True)
class TrajectoryTarget(ShapeTarget):
    """Through ``positions_m`` (n, 3) at ``times_s`` (n,), at rest at the first and the last.

    Quintics between the points, with the velocities and accelerations of the clamped cubic spline
    inside and none at the ends: continuous in acceleration, bounded in jerk.
    """

    name, kind = "trajectory", 10

    times_s: tuple[float, ...]
    positions_m: tuple[Triple, ...]
    id: int = 0
    law: LawName = field(default=LawName.DEFAULT, compare=False)
    _pieces: list[list[list[float]]] = field(init=False, repr=False, compare=False)

    @classmethod
    def checked(cls, fields: checks.Fields, allowed: checks.Allowed, law: LawName) -> Self:
        """Waypoints in the base frame, in the order of their times."""
        waypoints = fields["waypoints"]
        if not 2 <= len(waypoints) <= MAX_WAYPOINTS:
            raise TargetRejected(f"{len(waypoints)} waypoints; 2 to {MAX_WAYPOINTS} are needed")
        times = tuple(point["time_s"] for point in waypoints)
        if not (math.isfinite(sum(times)) and times[0] >= 0.0 and times[-1] <= _LONGEST_S):
            raise TargetRejected(f"time_s of the waypoints: 0 to {_LONGEST_S:g} s are allowed")
        for index, (before, after) in enumerate(pairwise(times), 2):
            if after - before < _SHORTEST_S:
                raise TargetRejected(
                    f"waypoint {index} is at {after:g} s, waypoint {index - 1} at {before:g} s; "
                    f"times must increase by {_SHORTEST_S:g} s or more"
                )
        checks.check_frame(fields, ("base",))
        points = tuple(triple(allowed.place(point, "position_m")) for point in waypoints)
        return cls(times, points, fields["id"], law)

    @property
    def start_s(self) -> float:
        """Time of the first point."""
        return self.times_s[0]

    def marks(self) -> list[tuple[str, Array]]:
        """Return the waypoints."""
        return [(f"waypoint {i}", np.array(p)) for i, p in enumerate(self.positions_m, 1)]

    def samples_s(self) -> Array:
        """So many in each piece, however short it is beside the others."""
        pieces = list(pairwise(self.times_s))
        each = max(SAMPLES // len(pieces), _PIECE_SAMPLES)
        return np.concatenate([np.linspace(before, after, each) for before, after in pieces])

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

    def at(self, time_s: float) -> MovingPoint:
        """Position, velocity and acceleration; the first point before its time."""
        if time_s <= self.times_s[0]:
            return MovingPoint(list(self.positions_m[0]), _ZERO, _ZERO)
        if time_s >= self.times_s[-1]:
            return MovingPoint(list(self.positions_m[-1]), _ZERO, _ZERO)
        index = bisect_right(self.times_s, time_s) - 1
        t = time_s - self.times_s[index]
        position, velocity, acceleration = [], [], []
        for a, b, c, d, e, f in self._pieces[index]:
            position.append(a + t * (b + t * (c + t * (d + t * (e + t * f)))))
            velocity.append(b + t * (2 * c + t * (3 * d + t * (4 * e + t * 5 * f))))
            acceleration.append(2 * c + t * (6 * d + t * (12 * e + t * 20 * f)))
        return MovingPoint(position, velocity, acceleration)


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

"""What the ready motions of the tip over their own time have in common."""

import math
from abc import abstractmethod

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import TargetRejected
from pneuarm.controllers.geometry.moving_point import MovingPoint
from pneuarm.controllers.targets.checks import FARTHEST_ARM_LENGTHS, Allowed
from pneuarm.controllers.targets.target import Target
from pneuarm.controllers.tasks.wanted import Wanted

Triple = tuple[float, float, float]

SAMPLES, _MARKS = 400, 73

#: Of the limits of the reference: an axis has its share, less what rounding needs.
_AXIS_SHARE = 0.98 * 3.0**-0.5


class ShapeTarget(Target):
    """Tip along a shape, whose own time begins when it is first asked for.

    Smooth for ever: position, velocity and acceleration are continuous from 0 to ``duration_s``.
    Shapes are equal when they are the same motion and have the same ``id``, whatever the law:
    repeating a shape goes on with it, another id begins it anew.
    """

    id: int

    @property
    @abstractmethod
    def duration_s(self) -> float:
        """When it is over; may be infinite."""

    @property
    def start_s(self) -> float:
        """When it begins to move."""
        return 0.0

    @property
    def span_s(self) -> float:
        """Time after which it repeats itself, or is over."""
        return self.duration_s

    @abstractmethod
    def at(self, time_s: float) -> MovingPoint:
        """Where the tip is at a time; before the start and after the end it stands."""

    def marks(self) -> list[tuple[str, Array]]:
        """Places (3,) along the way that must be within reach, by what they are called."""
        times = np.linspace(0.0, min(self.span_s, self.duration_s), _MARKS)
        return [(f"the point at {t:.3g} s", np.array(self.at(float(t)).position)) for t in times]

    def samples_s(self) -> Array:
        """Times between which the tip does nothing that is not seen at them."""
        return np.linspace(self.start_s, self.span_s, SAMPLES)

    def check_motion(self, allowed: Allowed) -> None:
        """Refuse a shape that is far away, or faster than the reference may be along an axis."""
        times = self.samples_s().tolist()
        points = [self.at(time_s) for time_s in times]
        for time_s, point in zip(times, points, strict=True):
            distance = math.hypot(*point.position)
            if not distance <= allowed.farthest_m:
                raise TargetRejected(
                    f"the shape is {distance:.3g} m from the base at {time_s:.6g} s, more than "
                    f"{FARTHEST_ARM_LENGTHS:g} arm lengths; is it in mm, or are waypoints too "
                    "unevenly spaced in time?"
                )
        speed = np.abs([point.velocity for point in points]).max()
        force = np.abs([point.acceleration for point in points]).max()
        for name, unit, largest, most in (
            ("speed_max_mm_s", "mm/s", speed, _AXIS_SHARE * allowed.speed_m_s),
            ("acceleration_max_mm_s2", "mm/s^2", force, _AXIS_SHARE * allowed.acceleration_m_s2),
        ):
            if not largest <= most:  # a NaN too
                raise TargetRejected(
                    f"the shape needs {1e3 * largest:.0f} {unit} along an axis; allowed are "
                    f"{1e3 * most:.0f} (reference.{name} over the root of three): give it more "
                    "time"
                )

    def write(self, wanted: Wanted) -> None:
        """Refuse: it comes to the law as the positions along it, from the reference."""
        raise NotImplementedError


def perpendicular(normal: Array) -> tuple[Array, Array]:
    """Two unit vectors that make a right-handed frame with a normal (3,) of any length.

    The first is base x as far as it lies in the plane; base y where the normal is along x.
    """
    unit = normal / np.linalg.norm(normal)
    axis = np.array([1.0, 0.0, 0.0] if abs(unit[0]) < 0.9 else [0.0, 1.0, 0.0])
    first = axis - (axis @ unit) * unit
    first /= np.linalg.norm(first)
    return first, np.cross(unit, first)


def triple(values: Array) -> Triple:
    """Three plain floats."""
    x, y, z = (float(value) for value in values)
    return (x, y, z)

"""A point that moves, as the reference and the shapes tell it."""

from typing import NamedTuple


class MovingPoint(NamedTuple):
    """Position, velocity and acceleration of a point, plain lists of n numbers."""

    position: list[float]
    velocity: list[float]
    acceleration: list[float]

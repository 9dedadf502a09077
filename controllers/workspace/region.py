"""Where the tip of one section can be: an exact test, and the surface around it.

In shapes ``(L, theta, phi)`` the limits are the box of the chamber lengths, all three tied to one
arc by ``l_i = L - d theta cos(phi - alpha_i)``, and the cone ``theta <= bend_max``: a convex body.
The arc map carries it one to one (``theta < 2 pi``) into space, so the boundary there is the image
of three sheets: LOWER (a chamber at its shortest), UPPER (one at its longest) and SIDE (the bend).

The body looks the same after a turn by 120 deg and in a mirror through a chamber. So everything is
computed in the wedge ``0 <= phi <= 60 deg``, where chamber 1 is the shortest and chamber 3 the
longest and each sheet is smooth, and is folded into it and out of it. Source: Eq. (1) and (4).
"""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import lengths_from_shapes, section_inverse
from pneuarm.controllers.workspace.reachability import LimitNames

Sheets = NDArray[np.int64]

#: The wedge, rad.
WEDGE_RAD = np.pi / 3.0

#: What rounding may add to a length, or to a bend times the chamber offset (m). Far below
#: LENGTH_MARGIN_M, so a member lies strictly inside the open interval of Eq. (4) all the same.
ROUNDING_M = 1e-9


class Sheet(IntEnum):
    """The parts of the boundary."""

    LOWER = 0
    UPPER = 1
    SIDE = 2


class SectionRegion:
    """The positions of the tip of an arm with one section; all arrays in m and rad."""

    def __init__(self, arm: Arm) -> None:
        if arm.n_sections != 1:
            raise InvalidInput(f"arm {arm.name!r} has {arm.n_sections} sections; allowed: 1")
        self.arm = arm
        self.limits = LimitNames(arm)
        self.lower_m = float(self.limits.lower_m[0, 0])
        self.upper_m = float(self.limits.upper_m[0, 0])
        self.offset_m = arm.sections[0].chamber_offset_m
        self.bend_max_rad = arm.sections[0].bend_max_rad

    def contains(self, positions_m: Array) -> NDArray[np.bool_]:
        """Say for positions ``(..., 3)`` whether the one arc that ends there is within all limits.

        Exact up to ROUNDING_M in the lengths.
        """
        on_axis = (positions_m[..., 0] == 0.0) & (positions_m[..., 1] == 0.0)
        no_arc = on_axis & (positions_m[..., 2] <= 0.0)
        shapes = section_inverse(np.where(no_arc[..., None], (0.0, 0.0, 1.0), positions_m))
        lengths = lengths_from_shapes(shapes, self.offset_m)
        slack = np.minimum(lengths.min(-1) - self.lower_m, self.upper_m - lengths.max(-1))
        bend_left = self.bend_max_rad - np.hypot(shapes[..., 1], shapes[..., 2])
        inside: NDArray[np.bool_] = np.minimum(slack, self.offset_m * bend_left) >= -ROUNDING_M
        member: NDArray[np.bool_] = inside & ~no_arc
        return member

    def bend_end_rad(self, phi: Array) -> Array:
        """How far the section bends toward ``phi`` (in the wedge): by its limit, or by the box."""
        across = np.sqrt(3.0) * self.offset_m * np.cos(phi - 0.5 * WEDGE_RAD)
        end: Array = np.minimum(self.bend_max_rad, (self.upper_m - self.lower_m) / across)
        return end

    def kinks_rad(self) -> Array:
        """Directions of bending that bound the smooth parts: the wedge's, and where BEND ends."""
        ratio = (self.upper_m - self.lower_m) / (np.sqrt(3.0) * self.offset_m * self.bend_max_rad)
        half = np.arccos(min(ratio, 1.0))
        inner = [0.5 * WEDGE_RAD - half, 0.5 * WEDGE_RAD + half] if ratio < 1.0 else []
        return np.array([0.0, *[a for a in inner if 0.0 < a < WEDGE_RAD], WEDGE_RAD])

    def arc_lengths_m(self, theta: Array, phi: Array) -> tuple[Array, Array]:
        """Shortest and longest arc for a bend ``theta`` toward ``phi`` in the wedge."""
        bend_m = self.offset_m * theta
        return (
            self.lower_m + bend_m * np.cos(phi),
            self.upper_m - bend_m * np.cos(WEDGE_RAD - phi),
        )

    def shapes(self, sheet: Sheets, phi: Array, along: Array) -> tuple[Array, Array]:
        """Arc length and bend on the sheets: ``along`` 0..1 from the axis out, or up the side."""
        end = self.bend_end_rad(phi)
        theta = np.where(sheet == Sheet.SIDE, end, along * end)
        low, high = self.arc_lengths_m(theta, phi)
        share = np.where(sheet == Sheet.SIDE, along, sheet == Sheet.UPPER)
        return low + share * (high - low), theta

    def meridian(self, sheet: Sheets, phi: Array, along: Array) -> tuple[Array, Array]:
        """Distance from the axis and height of the points of :meth:`shapes`."""
        arc_length, theta = self.shapes(sheet, phi, along)
        half = 0.5 * theta
        chord = arc_length * np.sinc(half / np.pi)
        return chord * np.sin(half), chord * np.cos(half)

    def points(self, sheet: Sheets, phi: Array, along: Array) -> Array:
        """Points ``(..., 3)`` of the sheets in the wedge."""
        rho, z = self.meridian(sheet, phi, along)
        return np.stack([rho * np.cos(phi), rho * np.sin(phi), z], axis=-1)


def folded(vector: Array) -> tuple[Array, float, float]:
    """Fold a vector (3,) into the wedge; returns it, the turn (rad) and the side (1 or -1)."""
    phi = np.arctan2(vector[1], vector[0])
    turn = float(np.round(phi / (2.0 * WEDGE_RAD)) * 2.0 * WEDGE_RAD)
    side = 1.0 if phi >= turn else -1.0
    return unfolded(vector, -turn, 1.0) * np.array([1.0, side, 1.0]), turn, side


def unfolded(vector: Array, turn: float, side: float) -> Array:
    """Undo :func:`folded`: mirror, then turn about z."""
    x, y = vector[0], side * vector[1]
    cosine, sine = np.cos(turn), np.sin(turn)
    return np.array([cosine * x - sine * y, sine * x + cosine * y, vector[2]])

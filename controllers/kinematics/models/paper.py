"""This project's two forms behind the interface: the paper's Eq. (1) and the one that runs.

*Kinematic Modeling of a Spatial Soft Robot by an Improved Analytical Method Based on Serial
Robots*, Eq. (1), over ``(phi, theta, r)``; and the form over ``(L, u, v)`` of
:mod:`pneuarm.controllers.kinematics.constant_curvature`.

Where Eq. (1) fails: the straight arm has no radius, ``r (1 - cos theta)`` is infinity times zero,
NaN. Near it ``1 - cos theta`` loses its digits while ``r`` grows.
"""

from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths, tip_transform
from pneuarm.controllers.kinematics.models.model import chained, checked_lengths, transforms


@dataclass(frozen=True)
class PaperEquation1:
    """Eq. (1) as printed; the tip frame is turned back by ``-phi``, to be twist-free."""

    name: str = "the paper, Eq. (1)"

    def tip_transform(self, arm: Arm, lengths_m: Array) -> Array:
        """Transform (..., 4, 4) for lengths (..., n_sections, 3), m; NaN where straight.

        Raises InvalidInput for a wrong shape or a length that is no positive number.
        """
        lengths = checked_lengths(arm, lengths_m)
        shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))
        arc_length, u, v = np.moveaxis(shapes, -1, 0)
        phi, theta = np.arctan2(v, u), np.hypot(u, v)
        cp, sp, ct, st = np.cos(phi), np.sin(phi), np.cos(theta), np.sin(theta)
        with np.errstate(invalid="ignore", divide="ignore"):
            radius = arc_length / theta
            position = [radius * cp * (1.0 - ct), radius * sp * (1.0 - ct), radius * st]
        printed = [[cp * ct, -sp, cp * st], [sp * ct, cp, sp * st], [-st, 0.0 * st, ct]]
        back = [[cp, sp, 0.0 * cp], [-sp, cp, 0.0 * cp], [0.0 * cp, 0.0 * cp, 1.0 + 0.0 * cp]]
        zero = [0.0 * cp] * 3
        return chained(transforms(printed, position) @ transforms(back, zero))


@dataclass(frozen=True)
class SingularityFree:
    """The form over (L, u, v) that the daemon runs on."""

    name: str = "pneuarm (L, u, v)"

    def tip_transform(self, arm: Arm, lengths_m: Array) -> Array:
        """Transform (..., 4, 4) for lengths (..., n_sections, 3), m; never NaN.

        Raises InvalidInput for a wrong shape or a length outside Eq. (4).
        """
        return tip_transform(arm, lengths_m)

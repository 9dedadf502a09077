"""Webster and Jones's arc parameters from three lengths, as published.

R. J. Webster III and B. A. Jones, "Design and kinematic modeling of constant curvature continuum
robots: a review", International Journal of Robotics Research 29(13), 2010, the mapping for three
actuators: with ``g = l1^2 + l2^2 + l3^2 - l1 l2 - l1 l3 - l2 l3``

    phi   = atan( sqrt(3) (l2 + l3 - 2 l1) / (3 (l2 - l3)) )
    kappa = 2 sqrt(g) / (d (l1 + l2 + l3)),   l = (l1 + l2 + l3) / 3

and the arc's transform ``Rz(phi) [Ry(kappa l), (1 - cos(kappa l), 0, sin(kappa l)) / kappa]``.

Where it fails: at equal lengths ``g`` is zero, ``1 / kappa`` times zero is NaN, and ``phi`` is
undefined. In floating point ``g`` is what rounding leaves of it, at equal lengths and up to an
asymmetry of about 1e-9 of the length: zero or below it, which is NaN, or a positive number that
has nothing to do with the arm's bend.
"""

from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.models.model import chained, checked_lengths, transforms


def direction(lengths: Array) -> Array:
    """The published ``phi`` (...,) of lengths (..., 3), in the quadrant that its signs give.

    The authors count it in a frame whose y axis goes to chamber 1; this project's x axis does.
    """
    l1, l2, l3 = np.moveaxis(lengths, -1, 0)
    phi = np.arctan2(np.sqrt(3.0) * (l2 + l3 - 2.0 * l1), 3.0 * (l2 - l3))
    return np.asarray(phi)


def radicand(lengths: Array) -> Array:
    """The published ``g`` (...,) of lengths (..., 3), in m^2, rounding included."""
    l1, l2, l3 = np.moveaxis(lengths, -1, 0)
    return np.asarray(l1**2 + l2**2 + l3**2 - l1 * l2 - l1 * l3 - l2 * l3)


@dataclass(frozen=True)
class WebsterJones:
    """The published formulas; the tip frame is turned back by ``-phi``, to be twist-free."""

    name: str = "Webster and Jones"

    def tip_transform(self, arm: Arm, lengths_m: Array) -> Array:
        """Transform (..., 4, 4) for lengths (..., n_sections, 3), m; NaN where straight.

        Raises InvalidInput for a wrong shape or a length that is no positive number.
        """
        lengths = checked_lengths(arm, lengths_m)
        d = arm.per_section("chamber_offset_m")[:, 0]
        with np.errstate(invalid="ignore", divide="ignore"):
            total = lengths.sum(axis=-1)
            kappa = 2.0 * np.sqrt(radicand(lengths)) / (d * total)
            return chained(self._arc(direction(lengths) - 0.5 * np.pi, kappa, total / 3.0))

    @staticmethod
    def _arc(phi: Array, kappa: Array, length: Array) -> Array:
        """Rz(phi) [Ry, p] Rz(-phi)."""
        cp, sp = np.cos(phi), np.sin(phi)
        ct, st = np.cos(kappa * length), np.sin(kappa * length)
        out = (1.0 - ct) / kappa
        rotation = [
            [cp * cp * ct + sp * sp, cp * sp * (ct - 1.0), cp * st],
            [cp * sp * (ct - 1.0), sp * sp * ct + cp * cp, sp * st],
            [-cp * st, -sp * st, ct],
        ]
        return transforms(rotation, [cp * out, sp * out, st / kappa])

"""Jones and Walker's closed forms, as published.

B. A. Jones and I. D. Walker, "Kinematics for multisection continuum robots", IEEE Transactions on
Robotics 22(1), 2006: a section of ``n`` units, each with straight actuators between two plates;
with ``g`` and ``phi`` as in :mod:`pneuarm.controllers.kinematics.models.webster_jones`

    s     = n d (l1 + l2 + l3) / sqrt(g) asin( sqrt(g) / (3 n d) )
    kappa = 2 sqrt(g) / (d (l1 + l2 + l3))

and their homogeneous transform, which bends toward ``phi + 180 deg`` in the authors' frame.

Where it fails: at equal lengths ``s`` and the position are 0/0, NaN, and at and near them ``g``
rounds below zero. With few units the arc is longer than the mean of the lengths, by
``theta^2 / (24 n^2)`` of it: right for cables between plates, not for chambers that follow the
arc. For these ``n`` must be large.
"""

from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.models.model import chained, checked_lengths, transforms
from pneuarm.controllers.kinematics.models.webster_jones import direction, radicand


@dataclass(frozen=True)
class JonesWalker:
    """The published formulas with ``units`` a section. Raises InvalidInput for less than one."""

    units: int = 100
    name: str = "Jones and Walker"

    def __post_init__(self) -> None:
        if not self.units >= 1:
            raise InvalidInput(f"units = {self.units}: a section has 1 unit or more")

    def tip_transform(self, arm: Arm, lengths_m: Array) -> Array:
        """Transform (..., 4, 4) for lengths (..., n_sections, 3), m; NaN where straight.

        Raises InvalidInput for a wrong shape or a length that is no positive number.
        """
        lengths = checked_lengths(arm, lengths_m)
        d = arm.per_section("chamber_offset_m")[:, 0]
        with np.errstate(invalid="ignore", divide="ignore"):
            root, total = np.sqrt(radicand(lengths)), lengths.sum(axis=-1)
            n_d = self.units * d
            s = n_d * total / root * np.arcsin(root / (3.0 * n_d))
            kappa = 2.0 * root / (d * total)
            # Their frame, seen from this project's: turned by 90 degrees about z.
            return chained(self._published(direction(lengths) + 0.5 * np.pi, kappa, s))

    @staticmethod
    def _published(phi: Array, kappa: Array, s: Array) -> Array:
        """The homogeneous transform of their section."""
        cp, sp = np.cos(phi), np.sin(phi)
        ct, st = np.cos(kappa * s), np.sin(kappa * s)
        rotation = [
            [cp * cp * (ct - 1.0) + 1.0, sp * cp * (ct - 1.0), -cp * st],
            [sp * cp * (ct - 1.0), cp * cp * (1.0 - ct) + ct, -sp * st],
            [cp * st, sp * st, ct],
        ]
        out = (ct - 1.0) / kappa
        return transforms(rotation, [cp * out, sp * out, st / kappa])

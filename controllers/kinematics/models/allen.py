"""Allen and others' non-singular form, over the rotation vector of the tip.

T. F. Allen, L. Rupert, T. R. Duggan, G. Hein and K. Albert, "Closed-form non-singular
constant-curvature continuum manipulator kinematics", IEEE RoboSoft, 2020: the section turns by the
rotation vector ``(u, v, 0)``, of length ``phi``, about an axis across the backbone. With the
height ``h`` of the section

    p = h [ v (1 - cos phi) / phi^2,  -u (1 - cos phi) / phi^2,  sin(phi) / phi ]
    R = exp([u, v, 0]x)

and the limits of the quotients at ``phi = 0``, by series around it: nowhere singular. (Their
``(u, v)`` is the axis of bending; this project's is its direction, a quarter turn on.)
"""

from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.models.model import chained, checked_lengths, transforms

#: Below this angle (rad) the quotients are summed as series, to their fourth power.
_SERIES_BELOW_RAD = 1e-2


@dataclass(frozen=True)
class Allen:
    """The published form; it holds for the straight arm too."""

    name: str = "Allen"

    def tip_transform(self, arm: Arm, lengths_m: Array) -> Array:
        """Transform (..., 4, 4) for lengths (..., n_sections, 3), m; never NaN.

        Raises InvalidInput for a wrong shape or a length that is no positive number.
        """
        lengths = checked_lengths(arm, lengths_m)
        d = arm.per_section("chamber_offset_m")[:, 0]
        l1, l2, l3 = np.moveaxis(lengths, -1, 0)
        u = (l2 - l3) / (np.sqrt(3.0) * d)
        v = ((l2 - l1) + (l3 - l1)) / (3.0 * d)
        return chained(self._section(u, v, lengths.mean(axis=-1)))

    @staticmethod
    def _section(u: Array, v: Array, height: Array) -> Array:
        """Rodrigues's formula and the integral of its last column."""
        phi = np.hypot(u, v)
        near = phi < _SERIES_BELOW_RAD
        safe = np.where(near, 1.0, phi)
        square = phi**2
        sine = np.where(near, 1.0 - square / 6.0 * (1.0 - square / 20.0), np.sin(safe) / safe)
        cosine = np.where(
            near, 0.5 - square / 24.0 * (1.0 - square / 30.0), (1.0 - np.cos(safe)) / safe**2
        )
        rotation = [
            [1.0 - v * v * cosine, u * v * cosine, v * sine],
            [u * v * cosine, 1.0 - u * u * cosine, -u * sine],
            [-v * sine, u * sine, 1.0 - square * cosine],
        ]
        return transforms(rotation, [height * v * cosine, -height * u * cosine, height * sine])

"""Della Santina, Bicchi and Rus's state: differences of lengths in place of angles.

C. Della Santina, A. Bicchi and D. Rus, "On an improved state parametrization for soft robots with
piecewise constant curvature and its use in model based control", IEEE Robotics and Automation
Letters 5(2), 2020: ``(delta_x, delta_y, delta_L)`` with ``Delta = sqrt(delta_x^2 + delta_y^2)``
are lengths at the distance ``d`` from the backbone; with ``q = Delta / d``

    R = [ 1 + dx^2/Delta^2 (cos q - 1)   dx dy/Delta^2 (cos q - 1)       dx/Delta sin q ]
        [ dx dy/Delta^2 (cos q - 1)      1 + dy^2/Delta^2 (cos q - 1)    dy/Delta sin q ]
        [ -dx/Delta sin q                -dy/Delta sin q                 cos q          ]

    p = d (L0 + delta_L) / Delta^2 [dx (1 - cos q), dy (1 - cos q), Delta sin q]

up to the sign of delta, which here points where the arm bends. The state has no singularity, the
expressions are 0/0 at ``Delta = 0``: the authors take the limit there, and so does this.

Where it fails: nowhere; but ``1 - cos q`` is a difference of numbers that agree, so below
``q = 1e-8`` rad the sideways position, up to 1e-9 of the length, is lost to rounding.
"""

from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.models.model import chained, checked_lengths, transforms


def state_from_lengths(arm: Arm, lengths_m: Array) -> Array:
    """State ``(delta_x, delta_y, delta_L)`` (..., n_sections, 3), m, of lengths of that shape.

    Raises InvalidInput for a wrong shape or a length that is no positive number.
    """
    lengths = checked_lengths(arm, lengths_m)
    l1, l2, l3 = np.moveaxis(lengths, -1, 0)
    change = lengths.mean(axis=-1) - arm.per_section("rest_length_m")[:, 0]
    dx, dy = ((l2 - l1) + (l3 - l1)) / 3.0, (l3 - l2) / np.sqrt(3.0)
    return np.stack([dx, dy, change], axis=-1)


@dataclass(frozen=True)
class DellaSantina:
    """The published transform with its limit at the straight arm."""

    name: str = "Della Santina"

    def tip_transform(self, arm: Arm, lengths_m: Array) -> Array:
        """Transform (..., 4, 4) for lengths (..., n_sections, 3), m; never NaN.

        Raises InvalidInput for a wrong shape or a length that is no positive number.
        """
        dx, dy, change = np.moveaxis(state_from_lengths(arm, lengths_m), -1, 0)
        d = arm.per_section("chamber_offset_m")[:, 0]
        length = arm.per_section("rest_length_m")[:, 0] + change
        delta = np.hypot(dx, dy)
        straight = delta == 0.0
        safe = np.where(straight, 1.0, delta)
        ex, ey = dx / safe, dy / safe
        less, sine = np.cos(delta / d) - 1.0, np.sin(delta / d)
        rotation = [
            [1.0 + ex * ex * less, ex * ey * less, ex * sine],
            [ex * ey * less, 1.0 + ey * ey * less, ey * sine],
            [-ex * sine, -ey * sine, 1.0 + less],
        ]
        out = -d * length / safe * less
        ahead = np.where(straight, length, d * length / safe * sine)
        return chained(transforms(rotation, [ex * out, ey * out, ahead]))

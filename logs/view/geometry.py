"""Lines and points of the arm's shape for the 3D scene, in metres in the base frame; pure.

In single precision: that is what Rerun stores, and it takes such arrays without copying them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pneuarm.controllers.arm.arm import CHAMBER_ANGLES_RAD, Arm, Array
from pneuarm.controllers.kinematics.constant_curvature import curve_transforms

Points = NDArray[np.float32]

_POINTS_PER_SECTION = 20
_PLATE_RADIUS = 1.4  # of the chambers' distance from the backbone
_RING_ANGLES_RAD = np.linspace(0.0, 2.0 * np.pi, 37)


@dataclass(frozen=True)
class ArmLines:
    """Polylines of one configuration, P points each.

    ``backbone_m`` is (P, 3) over all sections, ``chambers_m`` (n_chambers, P, 3), ``plates_m`` one
    ring a section end (n_sections, P, 3), ``chamber_ends_m`` (n_chambers, 3) on those plates.
    """

    backbone_m: Points
    chambers_m: Points
    plates_m: Points
    chamber_ends_m: Points


class ArmShape:
    """Draws one arm, by constant curvature."""

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        offsets_m = arm.per_section("chamber_offset_m")[:, 0]
        self._chambers = _circles(CHAMBER_ANGLES_RAD, offsets_m)
        self._rings = _circles(_RING_ANGLES_RAD, _PLATE_RADIUS * offsets_m)

    def lines(self, lengths_m: Array) -> ArmLines:
        """Lines of the arm with lengths ``(n_sections, 3)``."""
        n, per_section = self._arm.n_sections, _POINTS_PER_SECTION
        frames = curve_transforms(self._arm, lengths_m, per_section)
        along = np.arange(per_section + 1) + per_section * np.arange(n)[:, None]
        chambers_m = _carried(frames[along], self._chambers).reshape(3 * n, per_section + 1, 3)
        plates_m = _carried(frames[along[:, -1:]], self._rings)[:, :, 0]
        return ArmLines(
            frames[:, :3, 3].astype(np.float32), chambers_m, plates_m, chambers_m[:, -1]
        )


def _circles(angles_rad: Array, radii_m: Array) -> Array:
    """Points (n_sections, n, 4), homogeneous, around the z axis of each section."""
    x, y = radii_m[:, None] * np.cos(angles_rad), radii_m[:, None] * np.sin(angles_rad)
    return np.stack([x, y, np.zeros_like(x), np.ones_like(x)], axis=-1)


def _carried(frames: Array, points: Array) -> Points:
    """Carry the points (n_sections, n, 4) along their section's frames (n_sections, P, 4, 4).

    Returns one line of P points for every point, ``(n_sections, n, P, 3)``.
    """
    lines: Array = frames[:, None, :, :3] @ points[:, :, None, :, None]
    return lines[..., 0].astype(np.float32)

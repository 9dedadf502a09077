"""The configurations that are drawn inside a picture of the workspace."""

from dataclasses import replace

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.constant_curvature import lengths_from_shapes
from pneuarm.controllers.workspace.region import SectionRegion
from pneuarm.controllers.workspace.support import in_wedge

#: Share of the bend, share of the way from the shortest to the longest arc, and whether every
#: other section bends the other way. A negative bend is toward -x.
_POSES = (
    (0.0, 0.0, False),
    (0.0, 1.0, False),
    (1.0, 0.5, False),
    (-1.0, 0.5, False),
    (0.55, 0.9, False),
    (-0.6, 0.85, True),
    (0.6, 0.1, True),
    (-0.35, 0.1, False),
)


def typical_lengths(arm: Arm) -> list[Array]:
    """Lengths ``(n_sections, 3)`` in the x-z plane, the arm at rest first."""
    poses = [_pose(arm, *pose) for pose in _POSES]
    return [arm.rest_lengths_m, *poses]


def _pose(arm: Arm, bend: float, stretch: float, alternating: bool) -> Array:
    rows = []
    for index, section in enumerate(arm.sections):
        side = -1.0 if alternating and index % 2 else 1.0
        region = SectionRegion(replace(arm, sections=(section,)))
        rows.append(_section_lengths(region, side * bend, stretch))
    return np.array(rows)


def _section_lengths(region: SectionRegion, bend: float, stretch: float) -> Array:
    phi = in_wedge(np.array(0.0 if bend >= 0.0 else np.pi))
    theta = abs(bend) * region.bend_end_rad(phi)
    low, high = region.arc_lengths_m(theta, phi)
    shape = np.array([low + stretch * (high - low), np.copysign(theta, bend), 0.0])
    return lengths_from_shapes(shape, region.offset_m)

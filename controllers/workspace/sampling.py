"""Random points of a workspace: an independent volume, and the manipulability all over it."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.compiled import CompiledKinematics
from pneuarm.controllers.kinematics.constant_curvature import lengths_from_shapes, section_inverse
from pneuarm.controllers.workspace.region import SectionRegion
from pneuarm.controllers.workspace.volume import Figure, extents_m

#: Standard deviations that an error of a random estimate stands for.
SIGMAS = 3.0


@dataclass(frozen=True)
class Samples:
    """Random configurations: S of them.

    ``positions_m`` (S, 3), ``lengths_m`` and ``pressures_pa`` (S, n_sections, 3). With
    ``J = dp/dl``: ``manipulability`` (S,) is ``sqrt(det(J J^T))``, the volume that the tip covers
    for a unit volume of lengths, and ``condition`` (S,) the ratio of J's outer singular values.
    """

    positions_m: Array
    lengths_m: Array
    pressures_pa: Array
    manipulability: Array
    condition: Array

    def chosen(self, index: NDArray[np.int64]) -> "Samples":
        """Return the samples with these indices."""
        return Samples(*(getattr(self, field.name)[index] for field in fields(self)))


def samples_at(arm: Arm, lengths_m: Array) -> Samples:
    """Evaluate configurations ``(S, n_sections, 3)``."""
    kinematics = CompiledKinematics(arm)
    positions = np.empty((len(lengths_m), 3))
    jacobians = np.empty((len(lengths_m), 3, arm.n_chambers))
    for index, lengths in enumerate(lengths_m):
        tip = kinematics.evaluate(lengths)
        positions[index], jacobians[index] = tip.position_m, tip.jacobian[:3]
    singular = np.linalg.svd(jacobians, compute_uv=False)
    return Samples(
        positions,
        lengths_m,
        PressureMap(arm).pressures_pa(lengths_m),
        np.prod(singular, axis=1),
        singular[:, 0] / singular[:, -1],
    )


def uniform_samples(
    region: SectionRegion, count: int, rng: np.random.Generator
) -> tuple[Samples, Figure]:
    """Draw ``count`` points in the bounding box; return the members and the volume (m^3).

    The members are uniform in volume. The error of the volume is SIGMAS standard deviations.
    Raises InvalidInput for a count below 1.
    """
    if count < 1:
        raise InvalidInput(f"count = {count}: at least 1 point is needed")
    low, high = extents_m(region)
    points = rng.uniform(low, high, (count, 3))
    members = samples_of(region, points)
    return members, share_of(float(np.prod(high - low)), len(members.positions_m), count)


def samples_of(region: SectionRegion, points_m: Array) -> Samples:
    """Samples at those of the points ``(n, 3)`` that one section reaches, in their order."""
    members = points_m[region.contains(points_m)]
    lengths = lengths_from_shapes(section_inverse(members), region.offset_m)
    return samples_at(region.arm, lengths[:, None])


def share_of(box_m3: float, hits: int, count: int) -> Figure:
    """Volume (m^3) from ``hits`` of ``count`` points in a box, by the binomial distribution."""
    # One hit more and one miss more (Laplace), so that 0 and all have an error too.
    share = (hits + 1.0) / (count + 2.0)
    deviation = np.sqrt(share * (1.0 - share) / count)
    error = float(SIGMAS * deviation * box_m3)
    return Figure(hits / count * box_m3, error, f"{count} random points, {SIGMAS:g} sigma")

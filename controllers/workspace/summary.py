"""Everything there is to say about an arm's workspace, computed in one go."""

from dataclasses import dataclass, replace

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.workspace.hull import SearchedShape
from pneuarm.controllers.workspace.mesh import Mesh, section_mesh
from pneuarm.controllers.workspace.nearest import BoundarySearch
from pneuarm.controllers.workspace.region import SectionRegion
from pneuarm.controllers.workspace.sampling import Samples, samples_at, uniform_samples
from pneuarm.controllers.workspace.search import SearchedRegion, random_configurations
from pneuarm.controllers.workspace.volume import (
    Figure,
    extents_error_m,
    extents_m,
    integrated_volume,
    least_radius_over_offset,
    meshed_volume,
)
from pneuarm.controllers.workspace.workspace import SolvedRegion, Workspace

_LEAST_SAMPLES = 10
_SAMPLES_A_SEARCH = 10  # a search takes about a millisecond


@dataclass(frozen=True)
class Summary:
    """The workspace of one arm.

    ``volume`` (m^3) has its independent checks beside it; ``extents_m`` (2, 3) are the least and
    greatest x, y, z. ``least_radius`` (n_sections,) is the least radius of curvature over the
    chambers' distance from the backbone. ``exact`` is False where searches stand behind it.
    """

    arm: Arm
    exact: bool
    volume: Figure
    checks: tuple[Figure, ...]
    extents_m: Array
    extents_error_m: float
    furthest_from_base_m: float
    furthest_from_axis_m: float
    least_radius: Array
    mesh: Mesh
    samples: Samples


def summarise(arm: Arm, samples: int, seed: int = 0) -> Summary:
    """Compute the summary with about ``samples`` random points.

    Raises InvalidInput for fewer than 10 samples.
    """
    if samples < _LEAST_SAMPLES:
        raise InvalidInput(f"samples = {samples}: at least {_LEAST_SAMPLES} are needed")
    rng = np.random.default_rng(seed)
    region = Workspace(arm).region
    if isinstance(region, SolvedRegion):
        return _solved(region.region, region.boundary, samples, rng)
    return _searched(arm, region, samples, rng)


def _solved(
    region: SectionRegion, boundary: BoundarySearch, count: int, rng: np.random.Generator
) -> Summary:
    volume, meshed = integrated_volume(region), meshed_volume(region)
    samples, counted = uniform_samples(region, count, rng)
    # Two independent ways: where they differ by more than either admits, the difference counts.
    error = max(volume.error, abs(volume.value - meshed.value))
    return Summary(
        region.arm,
        True,
        Figure(volume.value, error, volume.method),
        (meshed, counted),
        extents_m(region),
        extents_error_m(region),
        -boundary.best(lambda points: -np.linalg.norm(points, axis=-1)).cost,
        -boundary.best(lambda points: -np.hypot(points[..., 0], points[..., 1])).cost,
        np.array([least_radius_over_offset(region)]),
        section_mesh(region),
        samples,
    )


def _searched(arm: Arm, region: SearchedRegion, count: int, rng: np.random.Generator) -> Summary:
    shape = SearchedShape(arm, region)
    mesh, (extents, error) = shape.hull(), shape.extents_m()
    sections = [SectionRegion(replace(arm, sections=(section,))) for section in arm.sections]
    return Summary(
        arm,
        False,
        shape.volume(mesh, max(count // _SAMPLES_A_SEARCH, 1), rng),
        (shape.hull_volume(),),
        extents,
        error,
        float(np.linalg.norm(mesh.vertices_m, axis=1).max()),
        float(np.hypot(mesh.vertices_m[:, 0], mesh.vertices_m[:, 1]).max()),
        np.array([least_radius_over_offset(section) for section in sections]),
        mesh,
        samples_at(arm, random_configurations(arm, count, rng)),
    )

"""Every model of the arm's shape against the Cosserat rod, over the workspace of one section.

The rod's numbers are those of table 1: its weight over bending stiffness, and three equal
chambers, which ties the axial stiffness to the bending stiffness. Errors are distances between
tips in percent of the arc length of the same configuration.
"""

import time
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths
from pneuarm.controllers.kinematics.models.allen import Allen
from pneuarm.controllers.kinematics.models.cosserat_rod import CosseratRod, three_springs
from pneuarm.controllers.kinematics.models.della_santina import DellaSantina
from pneuarm.controllers.kinematics.models.godage import Godage
from pneuarm.controllers.kinematics.models.jones_walker import JonesWalker
from pneuarm.controllers.kinematics.models.model import Model
from pneuarm.controllers.kinematics.models.paper import PaperEquation1, SingularityFree
from pneuarm.controllers.kinematics.models.webster_jones import WebsterJones

STANDARD_GRAVITY_M_S2 = 9.81
#: How the arm is mounted: gravity in its base frame.
MOUNTINGS = {
    "no gravity": (0.0, 0.0, 0.0),
    "hanging": (0.0, 0.0, STANDARD_GRAVITY_M_S2),
    "sideways": (STANDARD_GRAVITY_M_S2, 0.0, 0.0),
}
#: One chamber is longer than the others by this much (m): where formulas begin to fail.
ASYMMETRIES_M = (0.0, 1e-15, 1e-12, 1e-9, 1e-6)
_REPEATS = 5
_STRAIGHT_LENGTHS = 100


@dataclass(frozen=True)
class NearStraight:
    """Without gravity: share of NaN, and the worst error where there is an answer (or None)."""

    nan_share: float
    worst_percent: float | None


@dataclass(frozen=True)
class ModelResult:
    """One model: errors in percent of the arc length, times in microseconds.

    ``mean_percent`` and ``worst_percent`` by mounting, over the samples with an answer;
    ``nan_share`` of the samples without; ``near_straight`` by asymmetry (m, as text).
    """

    name: str
    mean_percent: dict[str, float]
    worst_percent: dict[str, float]
    nan_share: float
    near_straight: dict[str, NearStraight]
    one_us: float
    batch_us: float


def all_models() -> tuple[Model, ...]:
    """Return the models that are compared, in the order of their years."""
    return (
        JonesWalker(),
        JonesWalker(units=10, name="Jones and Walker, 10 units"),
        WebsterJones(),
        Godage(5),
        Godage(11),
        Allen(),
        DellaSantina(),
        PaperEquation1(),
        SingularityFree(),
    )


def reference_rod(arm: Arm, weight_over_bending_per_m3: float) -> CosseratRod:
    """Return the rod of the arm's first section.

    ``weight_over_bending_per_m3`` is the weight a metre of rest length over the bending
    stiffness; only this ratio matters for the shape.
    """
    if not 0.0 <= weight_over_bending_per_m3 < np.inf:
        raise InvalidInput(
            f"weight_over_bending_per_m3 = {weight_over_bending_per_m3:g}: "
            "it must be 0 or more, and finite"
        )
    density = weight_over_bending_per_m3 / STANDARD_GRAVITY_M_S2
    return CosseratRod(three_springs(arm.sections[0].chamber_offset_m, 1.0, density))


def workspace_samples(arm: Arm, count: int, seed: int = 0) -> Array:
    """Lengths (count, n_sections, 3), m, uniform in the box of lengths, inside the bend limit."""
    if count < 1:
        raise InvalidInput(f"count = {count}: at least 1 sample is needed")
    rng = np.random.default_rng(seed)
    low, high = length_bounds_m(arm)
    kept = np.zeros((0, arm.n_sections, 3))
    while len(kept) < count:
        lengths = rng.uniform(low, high, (count, *low.shape))
        shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))
        bend = np.hypot(shapes[..., 1], shapes[..., 2])
        kept = np.concatenate([kept, lengths[(bend <= arm.per_section("bend_max_rad").T).all(-1)]])
    return kept[:count]


def tip_errors_percent(tips: Array, reference: Array, lengths_m: Array) -> Array:
    """Distances (...,) of transforms (..., 4, 4), percent of the arc length of (..., n, 3)."""
    arc_length = lengths_m.mean(axis=-1).sum(axis=-1)
    distance = np.linalg.norm(tips[..., :3, 3] - reference[..., :3, 3], axis=-1)
    return np.asarray(100.0 * distance / arc_length)


def compare(arm: Arm, weight_over_bending_per_m3: float, count: int = 1000) -> list[ModelResult]:
    """Compare all models over ``count`` samples; the reference itself comes last."""
    rod = reference_rod(arm, weight_over_bending_per_m3)
    lengths = workspace_samples(arm, count)
    mounted = {name: replace(arm, gravity_m_s2=g) for name, g in MOUNTINGS.items()}
    tips = {name: rod.tip_transform(like, lengths) for name, like in mounted.items()}
    results = [_result(model, arm, lengths, tips, rod) for model in all_models()]
    return [*results, _result(rod, mounted["hanging"], lengths, tips, rod)]


def _result(
    model: Model, arm: Arm, lengths: Array, reference: dict[str, Array], rod: CosseratRod
) -> ModelResult:
    tips = model.tip_transform(arm, lengths)
    errors = {name: tip_errors_percent(tips, there, lengths) for name, there in reference.items()}
    if model is rod:  # against itself, mounted as each time: what is left is zero by definition
        errors = {name: np.where(np.isnan(tips[:, 0, 3]), np.nan, 0.0) for name in reference}
    return ModelResult(
        name=model.name,
        mean_percent={name: float(np.nanmean(error)) for name, error in errors.items()},
        worst_percent={name: float(np.nanmax(error)) for name, error in errors.items()},
        nan_share=float(np.isnan(tips).any(axis=(-2, -1)).mean()),
        near_straight=_near_straight(model, arm, rod),
        one_us=_time_us(model, arm, lengths[:1]),
        batch_us=_time_us(model, arm, lengths) / len(lengths),
    )


def _near_straight(model: Model, arm: Arm, rod: CosseratRod) -> dict[str, NearStraight]:
    """Errors without gravity at _STRAIGHT_LENGTHS lengths, chamber 1 longer by ASYMMETRIES_M."""
    free = replace(arm, gravity_m_s2=MOUNTINGS["no gravity"])
    low, high = length_bounds_m(arm)
    shares = np.linspace(0.05, 0.95, _STRAIGHT_LENGTHS)[:, None, None]
    results = {}
    for asymmetry in ASYMMETRIES_M:
        lengths = low + shares * (high - low)
        lengths[:, 0, 0] += asymmetry
        exact = rod.tip_transform(free, lengths)
        errors = tip_errors_percent(model.tip_transform(free, lengths), exact, lengths)
        answered = errors[np.isfinite(errors)]
        worst = float(answered.max()) if answered.size else None
        results[f"{asymmetry:g}"] = NearStraight(float(1 - answered.size / errors.size), worst)
    return results


def _time_us(model: Model, arm: Arm, lengths: Array) -> float:
    """Best of several calls, microseconds."""
    best = np.inf
    for _ in range(_REPEATS):
        start = time.perf_counter()
        model.tip_transform(arm, lengths)
        best = min(best, time.perf_counter() - start)
    return 1e6 * best


def as_json(results: list[ModelResult]) -> list[dict[str, Any]]:
    """Return the results for a JSON file."""
    return [asdict(result) for result in results]

"""The figures of the kinematics: how well its forms agree, over many random configurations.

    .venv/bin/python -m tools.validation.figures_kinematics [--samples N]

Prints one JSON object. Lengths are metres, angles radians; ``worst`` is over all samples.
"""

import argparse
import json
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path

import numpy as np

from pneuarm.controllers.kinematics.constant_curvature import (
    lengths_from_shapes,
    section_inverse,
    section_transforms,
    shapes_from_lengths,
    tip_transform,
)
from pneuarm.controllers.kinematics.inverse import inverse
from pneuarm.controllers.kinematics.jacobians import jacobians, section_jacobians
from pneuarm.controllers.kinematics.parameters import arc_rates, in_frame, shapes_from_arcs
from pneuarm.controllers.kinematics.serial_chain import (
    chain_transform,
    paper_transform,
    propagated_jacobian,
    serial_jacobian,
    velocity_jacobian,
)
from pneuarm.controllers.kinematics.smooth import smooth
from tools.rig.arms import paper_arm, random_lengths, trunk_arm
from tools.validation import precise
from tools.validation.markdown import markdown_table

ROOT = Path(__file__).parents[2]
OFFSET_M = 0.038
ASYMMETRIES_M = (0.0, 1e-15, 1e-12, 1e-9, 1e-6)
CHUNK = 50_000
#: Weights of the central difference of sixth order.
_STENCIL = ((1, 45.0 / 60.0), (2, -9.0 / 60.0), (3, 1.0 / 60.0))

Figures = dict[str, float]


def random_arcs(rng: np.random.Generator, number: int) -> np.ndarray:
    """Random (phi, theta, r) with theta from 1e-3 to 3.5 rad, half of them of small theta."""
    low, high = 1e-3, 3.5
    theta = rng.uniform(low, high, number)
    theta[::2] = low * (high / low) ** rng.uniform(size=theta[::2].size)
    phi = rng.uniform(-np.pi, np.pi, number)
    return np.stack([phi, theta, rng.uniform(0.1, 0.3, number) / theta], axis=-1)


def worst(samples: int, figures: Callable[[int], Figures]) -> Figures:
    """The largest of every figure over chunks of at most CHUNK samples."""
    result: Figures = {}
    for start in range(0, samples, CHUNK):
        for name, value in figures(min(CHUNK, samples - start)).items():
            result[name] = float(max(result.get(name, 0.0), value))
    return result


def forms(rng: np.random.Generator, number: int) -> Figures:
    """Serial chain, Eq. (1) and the singularity-free form against each other."""
    arcs = random_arcs(rng, number)
    paper, chain = paper_transform(*arcs.T), chain_transform(*arcs.T)
    shapes = shapes_from_arcs(arcs)
    free = section_transforms(shapes)
    return {
        "chain_and_eq1_m": np.abs(chain - paper)[:, :3, 3].max(),
        "singularity_free_and_eq1_m": np.abs(free - paper)[:, :3, 3].max(),
        "singularity_free_and_chain_m": np.abs(free - chain)[:, :3, 3].max(),
        "rotations": np.abs(in_frame(free, shapes, "paper") - paper)[:, :3, :3].max(),
    }


def nearly_straight(rng: np.random.Generator, number: int) -> Figures:
    """The singularity-free form against arbitrary precision, theta from 0 over 1e-300 to 1e-3."""
    theta = 10.0 ** rng.uniform(-300.0, -3.0, number)
    theta[::2] = 10.0 ** rng.uniform(-12.0, -3.0, theta[::2].size)
    theta[0] = 0.0
    phi = rng.uniform(-np.pi, np.pi, number)
    length = rng.uniform(0.1, 0.3, number)
    shapes = np.stack([length, theta * np.cos(phi), theta * np.sin(phi)], axis=-1)
    tips = section_transforms(shapes)[:, :3, 3]
    absolute, relative = 0.0, 0.0
    for shape, tip in zip(shapes, tips, strict=True):
        for computed, exact in zip(tip, precise.position_m(shape), strict=True):
            error = abs(Decimal(float(computed)) - exact)
            absolute = max(absolute, float(error))
            relative = max(relative, float(error / abs(exact)) if abs(exact) > 1e-290 else 0.0)
    return {"straight_and_precise_m": absolute, "straight_and_precise_relative": relative}


def smooth_functions(number: int) -> Figures:
    """S, C, E and the derivatives against arbitrary precision, relative, theta up to 1 rad."""
    q = np.append(0.0, np.logspace(-300.0, 0.0, number - 1))
    ours = smooth(q)
    error = 0.0
    for index, value in enumerate(q):
        for name, exact in precise.smooth(value).items():
            error = max(error, abs(getattr(ours, name)[index] / exact - 1.0))
    return {"smooth_functions_relative": float(error)}


def columnwise(jacobian: np.ndarray, reference: np.ndarray) -> float:
    """Largest difference of two (..., 6, n) in a column, relative to the column's length."""
    difference = np.abs(jacobian - reference).max(axis=-2)
    return float((difference / np.linalg.norm(reference, axis=-2)).max())


def numerical_jacobian(
    transforms: Callable[[np.ndarray], np.ndarray], at: np.ndarray, steps: np.ndarray
) -> np.ndarray:
    """Twist (..., 6, n) of ``transforms`` over ``at`` (..., n); ``steps`` broadcasts to it."""
    inverse_rotation = np.swapaxes(transforms(at)[..., :3, :3], -1, -2)
    columns = []
    for direction in np.eye(at.shape[-1]):
        offset = direction * steps
        rate = sum(
            weight * (transforms(at + k * offset) - transforms(at - k * offset))
            for k, weight in _STENCIL
        )
        rate = rate / (offset.sum(axis=-1)[..., None, None])
        spin = rate[..., :3, :3] @ inverse_rotation
        turn = [spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]]
        columns.append(np.concatenate([rate[..., :3, 3], np.stack(turn, axis=-1)], axis=-1))
    return np.stack(columns, axis=-1)


def paper_jacobians(rng: np.random.Generator, number: int) -> Figures:
    """Eq. (2) printed, propagated, Eq. (3), numbers and the singularity-free Jacobian."""
    arcs = random_arcs(rng, number)
    printed = velocity_jacobian(*arcs.T)
    steps = np.stack([np.full(number, 0.02), np.full(number, 0.02), 0.02 * arcs[:, 2]], axis=-1)
    numerical = numerical_jacobian(lambda at: paper_transform(*np.moveaxis(at, -1, 0)), arcs, steps)
    shapes = shapes_from_arcs(arcs)
    free = section_jacobians(shapes) @ arc_rates(shapes)
    free[:, 3:, 0] += section_transforms(shapes)[:, :3, 2]  # the paper's frame turns by phi_dot
    return {
        "eq2_and_propagation_relative": columnwise(propagated_jacobian(*arcs.T), printed),
        "eq2_and_eq3_relative": columnwise(serial_jacobian(*arcs.T), printed),
        "eq2_and_numerical_relative": columnwise(numerical, printed),
        "eq2_and_singularity_free_relative": columnwise(free, printed),
    }


def length_jacobians(rng: np.random.Generator, number: int) -> Figures:
    """The Jacobian over the lengths against numbers, a tenth of the arms straight or nearly so."""
    arm = paper_arm()
    lengths = rng.uniform(0.12, 0.28, (number, 1, 3))
    nearly = lengths[: number // 10]
    nearly[:] = nearly[..., :1] + rng.choice(ASYMMETRIES_M, nearly.shape)
    numerical = numerical_jacobian(
        lambda at: tip_transform(arm, at.reshape(-1, 1, 3)),
        lengths.reshape(-1, 3),
        np.full((number, 3), 1e-3),
    )
    return {
        "singularity_free_and_numerical_relative": columnwise(jacobians(arm, lengths), numerical)
    }


def there_and_back(rng: np.random.Generator, number: int) -> Figures:
    """Lengths of the box forward and by the exact inverse back."""
    lengths = rng.uniform(0.1, 0.3, (number, 3))
    return _round_trip("round_trip", lengths)


def _round_trip(name: str, lengths: np.ndarray) -> Figures:
    tips = section_transforms(shapes_from_lengths(lengths, OFFSET_M))[:, :3, 3]
    back = lengths_from_shapes(section_inverse(tips), OFFSET_M)
    nans = np.count_nonzero(~np.isfinite(back)) + np.count_nonzero(~np.isfinite(tips))
    return {f"{name}_m": float(np.abs(back - lengths).max()), f"{name}_nan": float(nans)}


def asymmetries(rng: np.random.Generator, number: int) -> Figures:
    """The same for arms that are straight but for one chamber."""
    figures: Figures = {}
    for asymmetry_m in ASYMMETRIES_M:
        lengths = np.repeat(rng.uniform(0.101, 0.299, (number, 1)), 3, axis=1)
        lengths[np.arange(number), rng.integers(0, 3, number)] += asymmetry_m
        figures |= _round_trip(f"round_trip_at_{asymmetry_m:g}", lengths)
    return figures


def several_sections(rng: np.random.Generator, number: int) -> dict[str, float]:
    """Poses of the three-section arm by the iterative inverse: what remains, and how often."""
    arm = trunk_arm()
    lengths = np.stack([random_lengths(arm, rng) for _ in range(number)])
    found = inverse(arm, tip_transform(arm, lengths))
    met = (found.position_residual_m < 1e-9) & (found.rotation_residual_rad < 1e-9)
    return {
        "trunk_inverse_met_share": float(met.mean()),
        "trunk_inverse_worst_m": float(found.position_residual_m.max()),
    }


def all_figures(samples: int, seed: int = 3) -> dict[str, float]:
    """Every figure; arbitrary precision and the iterative inverse over a part of the samples."""
    rng = np.random.default_rng(seed)
    few = max(samples // 200, 50)
    return {
        "samples": samples,
        **worst(samples, lambda number: forms(rng, number)),
        **nearly_straight(rng, few),
        **smooth_functions(few),
        **worst(samples, lambda number: paper_jacobians(rng, number)),
        **worst(samples, lambda number: length_jacobians(rng, number)),
        **worst(samples, lambda number: there_and_back(rng, number)),
        **asymmetries(rng, max(samples // 10, 10)),
        **several_sections(rng, min(few, 300)),
    }


#: What each figure of the document says, what it may be at most, and its keys.
_ROWS = (
    (
        "serial chain, Eq. (1) and the singularity-free form, tip positions",
        "1e-12 m",
        ("chain_and_eq1_m", "singularity_free_and_eq1_m", "singularity_free_and_chain_m"),
    ),
    (
        "below a bend of 1e-3 rad: singularity-free form against arbitrary precision",
        "1e-12 m",
        ("straight_and_precise_m",),
    ),
    (
        "Eq. (2), Eq. (3), numerical derivative and singularity-free Jacobian",
        "1e-9 relative",
        (
            "eq2_and_propagation_relative",
            "eq2_and_eq3_relative",
            "eq2_and_numerical_relative",
            "eq2_and_singularity_free_relative",
            "singularity_free_and_numerical_relative",
        ),
    ),
    ("forward, then inverse, over the box", "1e-12 m", ("round_trip_m",)),
    (
        "the same at asymmetries of 0, 1e-15, 1e-12, 1e-9 and 1e-6 m",
        "1e-12 m",
        tuple(f"round_trip_at_{size}_m" for size in ("0", "1e-15", "1e-12", "1e-09", "1e-06")),
    ),
)


def section() -> str:
    """Return the kinematics' part of docs/validation.md; about a quarter of a minute."""
    found = all_figures(1_000_000)
    rows = [[text, limit, f"{max(found[key] for key in keys):.1e}"] for text, limit, keys in _ROWS]
    table = markdown_table(["what agrees", "asked", "largest difference"], rows)
    nans = sum(value for key, value in found.items() if key.endswith("_nan"))
    return f"""## Kinematics: the equations against each other

One million random configurations of one section, bends of at least 1e-3 rad where Eq. (1) is
compared (below, the paper's parameters lose their meaning).

{table}

Results that are not numbers: {nans:g}. The inverse of a whole trunk of three sections from a pose
it can take came to rest on the pose in {100 * found["trunk_inverse_met_share"]:.0f} % of the
trials, otherwise it says by its residual how far off it is
({found["trunk_inverse_worst_m"]:.1e} m at worst here).

How fast it is stands in [benchmarks.md](benchmarks.md)."""


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=1_000_000)
    print(json.dumps(all_figures(parser.parse_args().samples), indent=2))


if __name__ == "__main__":
    main()

"""How fast the kinematics is, beside soromox compiled by JAX, in one process and on one core.

    make bench-setup
    .venv/bin/python -m tools.bench.kinematics --json

A single call is timed by the wall clock, a batch by processor time, so that other work on the
machine disturbs it little. Every time is the median over rounds in which all candidates take turns;
a ratio is the median of the rounds' ratios. Without soromox its figures are null.
"""

import argparse
import json
import os
import platform
import statistics
import time
from collections.abc import Callable

import numpy as np

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.kinematics.compiled import CompiledKinematics
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths, tip_transform
from tools.rig.arms import paper_arm

#: Large, as a map of a workspace is: beyond what fits the cache soromox is some times slower.
BATCH = 1_000_000
#: Small, for comparison: everything fits the cache.
SMALL = 10_000
SINGLE_CALLS = 2_000
SINGLE = ("fk_jacobian", "soromox_fk_jacobian")
SMALL_CALLS = 50
_LINK = {"length": 0.2, "radius": 0.02, "density": 1000.0, "young_modulus": 1e6}

Call = Callable[[], object]


def three_sections() -> Arm:
    """Three times the section of the paper's arm."""
    return Arm("three", paper_arm().sections * 3)


def samples(arm: Arm, number: int) -> np.ndarray:
    """Lengths (number, n_sections, 3), uniform within Eq. (4)."""
    low, high = arm.per_chamber("length_min_m"), arm.per_chamber("length_max_m")
    share = np.random.default_rng(0).uniform(0.001, 0.999, (number, arm.n_sections, 3))
    return low + share * (high - low)


def ours() -> dict[str, tuple[Call, int]]:
    """Candidates of this project: name -> (call, evaluations in one call)."""
    one, three = paper_arm(), three_sections()
    kinematics, lengths = CompiledKinematics(one), samples(one, 1)[0]
    batch, batch_three = samples(one, BATCH), samples(three, BATCH)
    out, small = np.zeros((BATCH, 4, 4)), batch[:SMALL]
    return {
        "fk_jacobian": (repeated(kinematics.fresh, lengths, SINGLE_CALLS), SINGLE_CALLS),
        "batch_fk": (lambda: tip_transform(one, batch, out), BATCH),
        "batch_fk_fresh": (lambda: tip_transform(one, batch), BATCH),
        "small_batch_fk": (
            repeated(lambda lengths: tip_transform(one, lengths), small, SMALL_CALLS),
            SMALL * SMALL_CALLS,
        ),
        "batch_fk_three": (lambda: tip_transform(three, batch_three, out), BATCH),
    }


def repeated(call: Callable[[np.ndarray], object], argument: np.ndarray, times: int) -> Call:
    """``times`` calls as one."""

    def calls() -> None:
        for _ in range(times):
            call(argument)

    return calls


def soromox() -> dict[str, tuple[Call, int]]:
    """The same from soromox: one segment that bends both ways and stretches; empty without it."""
    try:
        import jax
        from soromox.systems.components.links import LinkSpec
        from soromox.systems.pcs import PCS, PCSStructure
    except ImportError:
        return {}
    jax.config.update("jax_enable_x64", True)
    active = [False, True, True, True, False, False]
    link = LinkSpec.circular(
        **_LINK, poisson_ratio=0.45, reference_strain=[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]
    )
    robot = PCS.from_links(
        [link], structure=PCSStructure(strain_selector=jax.numpy.array(active)), backend="jax"
    )
    tip = jax.numpy.array(_LINK["length"])
    both = jax.jit(lambda q: robot.forward_kinematics_and_jacobian_inertialframe(q, tip))
    poses = jax.jit(jax.vmap(lambda q: robot.forward_kinematics(q, tip)))
    batch = strains(samples(paper_arm(), BATCH))
    check_same(np.asarray(poses(batch[:SMALL])), np.asarray(robot.g0))
    one, resident = batch[0].copy(), jax.numpy.array(batch)
    small = jax.numpy.array(batch[:SMALL])
    return {
        "soromox_fk_jacobian": (
            repeated(lambda q: [np.asarray(x) for x in both(q)], one, SINGLE_CALLS),
            SINGLE_CALLS,
        ),
        "soromox_batch_fk": (lambda: jax.block_until_ready(poses(resident)), BATCH),
        "soromox_small_batch_fk": (
            repeated(lambda q: jax.block_until_ready(poses(q)), small, SMALL_CALLS),
            SMALL * SMALL_CALLS,
        ),
    }


def strains(lengths_m: np.ndarray) -> np.ndarray:
    """Active strains (m, 3) of lengths (m, 1, 3): bending over the link's length, and stretch."""
    offset_m = paper_arm().sections[0].chamber_offset_m
    arc_length, u, v = shapes_from_lengths(lengths_m[:, 0], offset_m).T / _LINK["length"]
    return np.stack([u, v, arc_length - 1.0], axis=1)


def check_same(poses: np.ndarray, base: np.ndarray) -> None:
    """Raise unless soromox's poses are ours: two speeds compare only for the same result.

    Its x axis runs along the link, and ``base`` turns it: its tip frame is ours times ``base``.
    """
    expected = tip_transform(paper_arm(), samples(paper_arm(), len(poses))) @ base
    np.testing.assert_allclose(poses, expected, atol=1e-9)


def rounds(candidates: dict[str, tuple[Call, int]], number: int) -> dict[str, list[float]]:
    """Seconds per evaluation of every candidate in every round, taking turns."""
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    for call, _ in candidates.values():
        call()
    for _ in range(number):
        for name, (call, evaluations) in candidates.items():
            clock = time.perf_counter if name in SINGLE else time.process_time
            start = clock()
            call()
            seconds[name].append((clock() - start) / evaluations)
    return seconds


def ratio(slow: list[float], fast: list[float]) -> float | None:
    """Median over the rounds of how many times faster ``fast`` was, None if one is missing."""
    pairs = [a / b for a, b in zip(slow, fast, strict=False)]
    return statistics.median(pairs) if pairs else None


def figures(number: int) -> dict[str, object]:
    """All figures as one object."""
    seconds = rounds(ours() | soromox(), number)
    median = {name: statistics.median(values) for name, values in seconds.items()}

    def us(name: str) -> float | None:
        return 1e6 * median[name] if name in median else None

    def per_s(name: str) -> float | None:
        return 1.0 / median[name] if name in median else None

    return {
        "fk_jacobian_us": us("fk_jacobian"),
        "soromox_fk_jacobian_us": us("soromox_fk_jacobian"),
        "fk_jacobian_times_faster": ratio(
            seconds.get("soromox_fk_jacobian", []), seconds["fk_jacobian"]
        ),
        "batch_fk_per_s": per_s("batch_fk"),
        "batch_fk_fresh_output_per_s": per_s("batch_fk_fresh"),
        "soromox_batch_fk_per_s": per_s("soromox_batch_fk"),
        "batch_fk_times_faster": ratio(seconds.get("soromox_batch_fk", []), seconds["batch_fk"]),
        "batch_fk_three_sections_per_s": per_s("batch_fk_three"),
        "three_sections_times_slower": ratio(seconds["batch_fk_three"], seconds["batch_fk"]),
        "small_batch_fk_per_s": per_s("small_batch_fk"),
        "soromox_small_batch_fk_per_s": per_s("soromox_small_batch_fk"),
        "small_batch": SMALL,
        "rounds": number,
        "batch": BATCH,
        "machine": platform.machine(),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def one_core() -> None:
    """Keep this process, and JAX when it comes, on one core."""
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    os.environ.update(
        JAX_PLATFORMS="cpu",
        XLA_FLAGS="--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
    )


def main() -> None:
    """Print the figures."""
    one_core()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="one JSON object")
    parser.add_argument("--rounds", type=int, default=15)
    arguments = parser.parse_args()
    result = figures(arguments.rounds)
    if arguments.json:
        print(json.dumps(result, indent=2))
    else:
        for name, value in result.items():
            print(f"{name:32} {value}")


if __name__ == "__main__":
    main()

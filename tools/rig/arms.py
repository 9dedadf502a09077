"""The arms that the tests use, built directly from Section and Arm, and random places in them."""

from dataclasses import replace

import numpy as np

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array, Section
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths

PAPER_SECTION = Section(
    rest_length_m=0.2,
    chamber_offset_m=0.038,
    length_min_m=0.1,
    length_max_m=0.3,
    bend_max_rad=2.5,
    length_rate_max_m_s=0.15,
    length_acceleration_max_m_s2=4.0,
    pressure_min_pa=-0.9e5,
    pressure_max_pa=0.9e5,
    pressure_slew_max_pa_s=2.0e5,
    lengthening_m_per_pa=1.0e-6,
    softening_m_per_pa2=1.4e-12,
)

TABLE1_SECTION = Section(
    rest_length_m=0.17172,
    chamber_offset_m=0.03801,
    length_min_m=0.08586,
    length_max_m=0.25758,
    bend_max_rad=2.0,
    length_rate_max_m_s=0.1,
    length_acceleration_max_m_s2=4.0,
    pressure_min_pa=0.0,
    pressure_max_pa=1.2e5,
    pressure_slew_max_pa_s=4.0e5,
    lengthening_m_per_pa=3.196e-7,
    softening_m_per_pa2=1.0994e-12,
)


def paper_arm() -> Arm:
    """The arm of the paper's section 4: the pressure range covers all of Eq. (4)."""
    return Arm("paper", (PAPER_SECTION,))


def table1_arm() -> Arm:
    """The arm of the paper's section 5: no vacuum, the pressure is the tighter bound."""
    return Arm("table1", (TABLE1_SECTION,))


def trunk_arm() -> Arm:
    """Three sections, no two alike."""
    sizes = ((0.15, 0.045, 1.2), (0.12, 0.038, 1.5), (0.10, 0.030, 1.8))
    return Arm(
        "trunk",
        tuple(
            replace(
                PAPER_SECTION,
                rest_length_m=rest,
                chamber_offset_m=offset,
                length_min_m=0.5 * rest,
                length_max_m=1.5 * rest,
                bend_max_rad=bend,
                lengthening_m_per_pa=5.0 * rest * 1e-6,
            )
            for rest, offset, bend in sizes
        ),
    )


#: For parametrisation: every arm by its name.
ARMS = {"paper": paper_arm(), "table1": table1_arm(), "trunk": trunk_arm()}


def random_lengths(arm: Arm, rng: np.random.Generator, share: float = 1.0) -> Array:
    """Lengths (n_sections, 3) within all limits, over ``share`` of the way to each of them."""
    offset, most = arm.per_section("chamber_offset_m"), arm.per_section("bend_max_rad")[:, 0]
    low, high = length_bounds_m(arm)
    middle, half = 0.5 * (low + high), 0.5 * share * (high - low)
    while True:
        lengths = rng.uniform(middle - half, middle + half)
        shapes = shapes_from_lengths(lengths, offset)
        if (np.hypot(shapes[:, 1], shapes[:, 2]) <= share * most).all():
            return lengths

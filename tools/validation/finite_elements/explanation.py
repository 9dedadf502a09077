"""Why the errors are what they are: sentences around the recorded numbers."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pneuarm.controllers.kinematics.constant_curvature import (
    lengths_from_shapes,
    section_inverse,
    section_transforms,
)
from tools.validation.finite_elements.design import PAPER_CASES, PAPER_WORST_PERCENT, TITLES
from tools.validation.finite_elements.records import Record, finest, states, worst_error


def paragraphs(results: Record) -> list[str]:
    """The explanation, one string a paragraph."""
    return [
        _what_remains(results),
        *_joining(results),
        *_caps_only(results),
        _slips(results),
        _LIMITS,
    ]


def _what_remains(results: Record) -> str:
    worst, case, pressure, deviation = max(
        (worst_error(row), case, row["pressure_bar"], max(row["line_deviation"]))
        for case in PAPER_CASES
        for row in states(results, finest(results, case), case)
    )
    return (
        f"The largest error of the paper's three cases is {worst:.3f} % ({TITLES[case].lower()}, "
        f"{pressure:g} bar); the paper has {PAPER_WORST_PERCENT} %. It is that small because the "
        "pressure in a chamber, on walls and caps together, is the same axial force and the same "
        "moment in every cross-section, however the arm bends: all segments between two discs bend "
        "alike, and together they are an arc. What remains is that the discs do not stretch and "
        "that a chamber is not held between two of them, where its centre line leaves the arc of "
        f"the model by up to {deviation:.3f} mm. The difference between the meshes tells how far "
        "the number itself can be trusted."
    )


def _joining(results: Record) -> Iterator[str]:
    few = states(results, "coarse", "one, two discs")[-1:]
    many = states(results, "coarse", "one")[-1:]
    for two, five in zip(few, many, strict=False):
        yield (
            "With two discs instead of five the gaps are twice as wide: one chamber at "
            f"{two['pressure_bar']:g} bar then gives {worst_error(two):.3f} % where five discs "
            f"give {worst_error(five):.3f} % on a mesh as coarse, and its centre lines leave the "
            f"arc by {max(two['line_deviation']):.2f} mm instead of "
            f"{max(five['line_deviation']):.2f} mm."
        )


def _caps_only(results: Record) -> Iterator[str]:
    caps = states(results, "coarse", "one, caps only")
    if caps:
        growing = ", ".join(
            f"{worst_error(row):.2f} % at {row['pressure_bar']:g} bar" for row in caps
        )
        yield (
            f"The load makes far more difference. With the pressure on the caps alone the error is "
            f"{growing}, and at the last of these the plate is turned by "
            f"{caps[-1]['tip_turn_deg']:.1f} degrees from the end of the arc; near 0.94 bar the "
            "solver finds no further equilibrium. The force then keeps its line of action, the "
            "moment grows toward the base, and the curve is no arc. A real chamber has walls."
        )


def _slips(results: Record) -> str:
    one = states(results, finest(results, "one"), "one")[-1]
    wrong_d, wrong_tip = offset_sensitivity(results, one, 1.0), tip_sensitivity(results, one, 3.0)
    return (
        f"Beside its {PAPER_WORST_PERCENT} % the paper names 'the error centers in the software "
        "drawing and calculation of the parameters'. Such slips are enough for it: with our "
        f"solution of one chamber at 1 bar, d taken 1 mm too large gives {wrong_d:.2f} %, and a "
        f"tip taken 3 mm beyond the cap, inside a plate, {wrong_tip:.2f} %. Whether it was one of "
        "them, or the load, cannot be told from the paper."
    )


_LIMITS = (
    "What this leaves out: gravity and contact, which do bend the arm away from an arc (see "
    "table 1), and the rubber's own law. The wall here is linear between Green-Lagrange strain "
    "and second Piola-Kirchhoff stress, so that it stiffens as it stretches, where the arm of "
    "table 1 softens: the lengthening per bar falls with the pressure instead of rising. By the "
    "argument above that changes how far a chamber lengthens, not whether the arm is an arc."
)


def offset_sensitivity(results: Record, row: Record, slip_mm: float) -> float:
    """Largest error (percent) if d were taken ``slip_mm`` too large."""
    return _largest_error(
        row, np.array(row["tip_position"]), results["design"]["chamber_offset"] + slip_mm
    )


def tip_sensitivity(results: Record, row: Record, slip_mm: float) -> float:
    """Largest error (percent) if the tip were taken ``slip_mm`` beyond the cap."""
    tip = np.array(row["tip_position"])
    axis = section_transforms(section_inverse(tip))[:3, 2]
    return _largest_error(row, tip + slip_mm * axis, results["design"]["chamber_offset"])


def _largest_error(row: Record, tip: NDArray[np.float64], offset: float) -> float:
    solved = np.array(row["lengths_solved"])
    lengths = lengths_from_shapes(section_inverse(tip), offset)
    return float(np.max(np.abs(100.0 * (lengths - solved) / solved)))

"""The parameters of a calibration: numbers near their nominal values, and the arm they stand for.

Every parameter is scaled, so that 1 is a large change of it: what the configuration says is 0 (for
a length or a lengthening, the logarithm of its ratio to the nominal one, so that ten times and a
tenth are as far) and the prior's standard deviations are plain numbers.

Of the nine gains from three pressures to three lengths a tip pose cannot tell a scale from the
lengthening, and a common ratio of bending to stretching from the chamber offset: the coupling has
trace 3, and its other six elements add up to zero. Where the frames of the measurement are fitted
too, a turn of all chambers about the backbone is taken out as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array, Section

_TURN = np.array([[0.0, 1.0, -1.0], [-1.0, 0.0, 1.0], [1.0, -1.0, 0.0]])
_FREE = np.linalg.svd(np.array([np.eye(3).ravel(), 1.0 - np.eye(3).ravel(), _TURN.ravel()]))[2][3:]

#: Elements (7, 3, 3) of a coupling that a tip pose can tell apart; the last one is the turn.
COUPLINGS: Array = np.concatenate([_FREE, _TURN.ravel()[None] / np.sqrt(6.0)]).reshape(7, 3, 3)

#: Name, standard deviation of the prior: how far from its nominal value a parameter may well be.
_PRIOR: tuple[tuple[str, float], ...] = (
    ("rest_length", 0.1),
    ("chamber_offset", 0.4),
    ("lengthening", 0.7),
    ("softening", 1.0),
    ("bending_compliance", 2.0),
    ("axial_compliance", 0.5),
    *((f"coupling_{number}", 0.4) for number in range(1, 8)),
)
NAMES: tuple[str, ...] = (*(name for name, _ in _PRIOR), "hysteresis")
PRIOR_SD: Array = np.array([sd for _, sd in _PRIOR] + [0.1])
#: Between these a parameter has a meaning; a softening, a compliance and a loop may well be 0.
LOWEST: Array = np.array([-3.5, -3.5, -4.5, 0.0, 0.0, 0.0, *[-2.0] * 7, 0.0])
HIGHEST: Array = np.array([3.5, 3.5, 4.5, 20.0, 50.0, 50.0, *[2.0] * 7, 0.5])
SHAPING = len(_PRIOR)  # parameters a section that enter the map; hysteresis comes before it


_BENDING = "bending_compliance_rad_per_n_m"


@dataclass(frozen=True)
class SymbolicSection:
    """The fields of a Section that the map uses, as symbols."""

    rest_length_m: Any
    chamber_offset_m: Any
    lengthening_m_per_pa: Any
    softening_m_per_pa2: Any
    bending_compliance_rad_per_n_m: Any
    axial_compliance_m_per_n: Any
    coupling: Any


@dataclass(frozen=True)
class SymbolicArm:
    """The fields of an Arm that the map uses, as symbols."""

    sections: Sequence[SymbolicSection]
    n_sections: int
    mass_kg: float
    gravity_m_s2: tuple[float, float, float]
    tool_m: tuple[float, float, float]


def values_of(arm: Arm, index: int, theta: Any) -> dict[str, Any]:
    """Fields of section ``index`` at its scaled parameters ``theta``, numbers or symbols.

    The scales: rest length, offset and lengthening the logarithm of their ratio to the nominal
    ones, the softening what doubles the lengthening at full pressure, a compliance what a hanging
    section with the weight of the whole arm loses of its bend, as a share, and gains in length,
    in tenths.
    """
    section = arm.sections[index]
    full_pa = max(section.pressure_max_pa, -section.pressure_min_pa)
    weight_n = arm.mass_kg * max(float(np.linalg.norm(arm.gravity_m_s2)), 1e-9)
    lengthening = section.lengthening_m_per_pa * ca.exp(theta[2])
    return {
        "rest_length_m": section.rest_length_m * ca.exp(theta[0]),
        "chamber_offset_m": section.chamber_offset_m * ca.exp(theta[1]),
        "lengthening_m_per_pa": lengthening,
        "softening_m_per_pa2": lengthening / full_pa * theta[3],
        "bending_compliance_rad_per_n_m": 12.0 * theta[4] / (weight_n * section.rest_length_m),
        "axial_compliance_m_per_n": 0.2 * section.rest_length_m / weight_n * theta[5],
    }


def start_of(arm: Arm) -> Array:
    """Scaled parameters (n_sections, len(NAMES)) that say what the arm's own fields say."""
    start = np.zeros((arm.n_sections, len(NAMES)))
    for index, section in enumerate(arm.sections):
        one = values_of(arm, index, np.where(np.arange(len(NAMES)) < 3, 0.0, 1.0))
        start[index, 3] = section.softening_m_per_pa2 / one["softening_m_per_pa2"]
        start[index, 4] = section.bending_compliance_rad_per_n_m / one[_BENDING]
        start[index, 5] = section.axial_compliance_m_per_n / one["axial_compliance_m_per_n"]
        start[index, 6:13] = np.tensordot(COUPLINGS, np.array(section.coupling) - np.eye(3), 2)
        start[index, 13] = section.hysteresis_pa / span_pa(section)
    return start


def span_pa(section: Section) -> float:
    """Pressure range of a section, the scale of its hysteresis."""
    return section.pressure_max_pa - section.pressure_min_pa


def symbolic_arm(arm: Arm, theta: ca.SX) -> SymbolicArm:
    """Arm whose fields are functions of the scaled parameters (n_sections, SHAPING)."""
    sections = []
    for index in range(arm.n_sections):
        row = [theta[index, place] for place in range(SHAPING)]
        coupling = ca.SX.eye(3)
        for basis, amount in zip(COUPLINGS, row[6:], strict=True):
            coupling = coupling + amount * ca.DM(basis)
        sections.append(SymbolicSection(**values_of(arm, index, row), coupling=coupling))
    return SymbolicArm(sections, arm.n_sections, arm.mass_kg, arm.gravity_m_s2, arm.tool_m)


def arm_of(arm: Arm, theta: Array) -> Arm:
    """Arm with the fields that the scaled parameters (n_sections, len(NAMES)) stand for."""
    sections = []
    for index, (section, row) in enumerate(zip(arm.sections, theta, strict=True)):
        fields = {name: float(value) for name, value in values_of(arm, index, row).items()}
        matrix = np.eye(3) + np.tensordot(row[6:13], COUPLINGS, 1)
        coupling: Any = tuple(tuple(values) for values in matrix.tolist())
        hysteresis_pa = float(row[13]) * span_pa(section)
        sections.append(replace(section, **fields, coupling=coupling, hysteresis_pa=hysteresis_pa))
    return replace(arm, sections=tuple(sections))

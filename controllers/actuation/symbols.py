"""The two sides of the pressure map in CasADi symbols, for numbers and for symbols as parameters.

An arm is anything that has the fields of :class:`pneuarm.controllers.arm.arm.Arm` used here: the
calibration passes one whose fields are symbols themselves.
"""

from typing import Any

import casadi as ca
import numpy as np

from pneuarm.controllers.arm.arm import CHAMBER_ANGLES_RAD, UNCOUPLED, Arm
from pneuarm.controllers.kinematics.compiled import symbolic_shape
from pneuarm.controllers.kinematics.gravity import masses_kg, symbolic_potential


def is_plain(arm: Arm) -> bool:
    """Whether no section has a coupling or a compliance: then every chamber is on its own."""
    return all(
        section.coupling == UNCOUPLED
        and section.bending_compliance_rad_per_n_m == 0.0
        and section.axial_compliance_m_per_n == 0.0
        for section in arm.sections
    )


def symbolic_lengthening(arm: Any, pressures: ca.SX) -> ca.SX:
    """Unloaded lengthening (n_chambers,), m, ``K (a p + b p |p|)``, of pressures (n_chambers,)."""
    parts = []
    for index, section in enumerate(arm.sections):
        p = pressures[3 * index : 3 * index + 3]
        own = p * (section.lengthening_m_per_pa + section.softening_m_per_pa2 * ca.fabs(p))
        parts.append(ca.SX(section.coupling) @ own)
    lengthening: ca.SX = ca.vertcat(*parts)
    return lengthening


def symbolic_unloaded(arm: Any, lengths: ca.SX) -> ca.SX:
    """Lengths (n_chambers,) without the weight of an arm that hangs at ``lengths``: q + c dV/dq."""
    shapes, values = ca.SX.sym("shapes", arm.n_sections, 3), []
    masses = masses_kg(arm.mass_kg, arm.sections)
    potential = symbolic_potential(shapes, masses, arm.gravity_m_s2)
    for index, section in enumerate(arm.sections):
        values.append(ca.horzcat(*symbolic_shape(lengths[3 * index : 3 * index + 3], section)))
    force = ca.substitute(ca.gradient(potential, shapes), shapes, ca.vertcat(*values))
    parts = []
    for index, section in enumerate(arm.sections):
        longer = section.axial_compliance_m_per_n * force[index, 0]
        du, dv = (section.bending_compliance_rad_per_n_m * force[index, k] for k in (1, 2))
        cos, sin = np.cos(CHAMBER_ANGLES_RAD), np.sin(CHAMBER_ANGLES_RAD)
        parts.append(longer - section.chamber_offset_m * (du * ca.DM(cos) + dv * ca.DM(sin)))
    unloaded: ca.SX = lengths + ca.vertcat(*parts)
    return unloaded

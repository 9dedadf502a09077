"""What the weight of a whole arm does to its sections: potential energy and generalised forces.

A section is an arc of even mass. Its centre of mass is ``L (u E, v E, C)`` in its base, with the
functions of :mod:`pneuarm.controllers.kinematics.smooth`: the integral of the constant-curvature
backbone in closed form, for the mean over ``s`` of ``S(s^2 q) s`` is C and that of ``C(s^2 q) s^2``
is E.
"""

from collections.abc import Sequence
from typing import Any

import casadi as ca

from pneuarm.controllers.kinematics.compiled import symbolic_section, symbolic_smooth


def masses_kg(mass_kg: float, sections: Sequence[Any]) -> list[Any]:
    """Mass of every section: all of it, spread evenly over the rest lengths."""
    total = sum(section.rest_length_m for section in sections)
    return [mass_kg * section.rest_length_m / total for section in sections]


def symbolic_potential(shapes: ca.SX, masses: Sequence[Any], gravity: Sequence[Any]) -> ca.SX:
    """Potential energy (J) of the weight at ``shapes`` (n_sections, 3) of ``(L, u, v)``.

    ``gravity`` is its acceleration in the base frame, m/s^2. Walking from the tip to the base, what
    follows a section is a body with a first moment ``sum m r`` (kg m) that the section turns.
    """
    moment, mass = ca.SX(3, 1), 0.0
    for index in reversed(range(len(masses))):
        arc_length, u, v = shapes[index, 0], shapes[index, 1], shapes[index, 2]
        position, rotation = symbolic_section(arc_length, u, v)
        f = symbolic_smooth(u * u + v * v)
        centre = arc_length * ca.vertcat(u * f.e, v * f.e, f.c)
        moment = masses[index] * centre + mass * position + rotation @ moment
        mass = mass + masses[index]
    return -ca.dot(ca.vertcat(*gravity), moment)

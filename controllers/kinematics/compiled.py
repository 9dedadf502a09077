"""Tip pose and Jacobian of a whole arm, compiled with CasADi for the tick.

The same singularity-free form as :mod:`pneuarm.controllers.kinematics.constant_curvature`, written
once more in CasADi symbols; the tests hold the two, and the derivative, against each other.
"""

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.geometry.compiled_function import CompiledFunction
from pneuarm.controllers.kinematics.smooth import Smooth, from_quarter, series

#: Terms of the series of the quarter angle: 1e-10 at theta = 20 rad, full precision below 4 pi.
_TERMS = 12


class TipState(NamedTuple):
    """What the tip does for given lengths. Views into buffers: valid until the next evaluation.

    ``position_m`` (3,), ``rotation`` (3, 3) from the twist-free tip frame to the base, and
    ``jacobian`` (6, n_chambers): linear rows (m/m) over angular rows (rad/m), in the base frame,
    with respect to the chamber lengths in C order.
    """

    position_m: Array
    rotation: Array
    jacobian: Array


def symbolic_smooth(theta_squared: ca.SX) -> Smooth:
    """S, C and their kin of :mod:`pneuarm.controllers.kinematics.smooth`, in CasADi symbols."""
    x = 0.0625 * theta_squared
    c, e = ca.SX(0), ca.SX(0)
    for next_c, next_e in series(_TERMS):
        c, e = c * x + next_c, e * x + next_e
    return from_quarter(theta_squared, c, e)


def symbolic_section(arc_length: ca.SX, u: ca.SX, v: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Position (3) and rotation (3, 3) of a section's tip in its base, in CasADi symbols."""
    position, rotation, _ = _section_with_jacobian(arc_length, u, v)
    return position, rotation


def _section_with_jacobian(arc_length: ca.SX, u: ca.SX, v: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Position, rotation and Jacobian (6, 3) over ``(L, u, v)``, in the base of the section.

    The derivative in closed form, as in :mod:`pneuarm.controllers.kinematics.jacobians`.
    """
    f = symbolic_smooth(u * u + v * v)
    uc, vc, us, vs = u * f.c, v * f.c, u * f.s, v * f.s
    uuc, uvc, vvc, uve = u * uc, u * vc, v * vc, u * v * f.e
    direction = ca.vertcat(uc, vc, f.s)
    rotation = ca.vertcat(
        ca.horzcat(1 - uuc, -uvc, us),
        ca.horzcat(-uvc, 1 - vvc, vs),
        ca.horzcat(-us, -vs, 1 - uuc - vvc),
    )
    dc_u, dc_v = 2 * arc_length * f.dc * u, 2 * arc_length * f.dc * v
    ds, along = 2 * arc_length * f.ds, arc_length * f.c
    jacobian = ca.vertcat(
        ca.horzcat(uc, along + u * dc_u, u * dc_v),
        ca.horzcat(vc, u * dc_v, along + v * dc_v),
        ca.horzcat(f.s, u * ds, v * ds),
        ca.horzcat(ca.SX(1, 1), -uve, u * u * f.e - 1),
        ca.horzcat(ca.SX(1, 1), 1 - v * v * f.e, uve),
        ca.horzcat(ca.SX(1, 1), -vc, uc),
    )
    return arc_length * direction, rotation, jacobian


def symbolic_shape(lengths: ca.SX, section: Any) -> tuple[ca.SX, ca.SX, ca.SX]:
    """``(L, u, v)`` of the three lengths of a section, whose fields may be symbols too."""
    first, second, third = lengths[0], lengths[1], lengths[2]
    u = ((second - first) + (third - first)) / (3.0 * section.chamber_offset_m)
    v = (third - second) / (np.sqrt(3.0) * section.chamber_offset_m)
    return (first + second + third) / 3.0, u, v


def _over_lengths(jacobian: ca.SX, section: Any) -> ca.SX:
    """Columns over ``(L, u, v)`` turned into columns over the three lengths."""
    d = section.chamber_offset_m
    mean, along = jacobian[:, 0] / 3.0, jacobian[:, 1] / (3.0 * d)
    across, side = jacobian[:, 2] / (np.sqrt(3.0) * d), mean + along
    columns: ca.SX = ca.horzcat(mean - 2.0 * along, side - across, side + across)
    return columns


def symbolic_tip(
    arm: Any, lengths: ca.SX, shares: list[ca.SX] | None = None
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Position, rotation and Jacobian (6, n_chambers) of the tip, ``lengths`` in C order.

    Walking from the tip to the base: a section turns what follows it and moves it by its lever.
    With ``shares`` only this part of every section (0 to 1) counts: a place on the backbone.
    """
    tool = ca.SX(ca.DM(arm.tool_m)) if shares is None else ca.SX(3, 1)
    position, rotation, columns = tool, ca.SX.eye(3), ca.SX(6, 0)
    for index in reversed(range(arm.n_sections)):
        share = 1.0 if shares is None else shares[index]
        shape = symbolic_shape(lengths[3 * index : 3 * index + 3], arm.sections[index])
        step, turn, local = _section_with_jacobian(*(share * part for part in shape))
        local = share * local
        lever = turn @ position
        linear = local[:3, :] - ca.skew(lever) @ local[3:, :]
        here = _over_lengths(ca.vertcat(linear, local[3:, :]), arm.sections[index])
        after = ca.vertcat(turn @ columns[:3, :], turn @ columns[3:, :])
        columns = ca.horzcat(here, after)
        position, rotation = step + lever, turn @ rotation
    return position, rotation, columns


class CompiledKinematics:
    """Tip pose and Jacobian through CasADi's buffer interface: about a microsecond a call."""

    def __init__(self, arm: Arm) -> None:
        lengths = ca.SX.sym("lengths", arm.n_chambers)
        position, rotation, jacobian = symbolic_tip(arm, lengths)
        transform = ca.vertcat(ca.horzcat(rotation, position), ca.DM([[0.0, 0.0, 0.0, 1.0]]))
        self._function = CompiledFunction("tip", [lengths], [transform, jacobian])
        self._shape = (arm.n_sections, 3)
        self._lengths = self._function.arguments[0].reshape(self._shape)
        self._transform, self._jacobian = self._function.results
        self._state = TipState(self._transform[:3, 3], self._transform[:3, :3], self._jacobian)

    def evaluate(self, lengths_m: Array) -> TipState:
        """Evaluate at ``lengths_m`` (n_sections, 3). The result's arrays are reused next time.

        Raises InvalidInput for another shape. The values are not checked: this is the tick's, whose
        lengths are within limits, and a NaN goes through to the result.
        """
        if lengths_m.shape != self._shape:
            self._refuse(lengths_m)
        self._lengths[...] = lengths_m
        self._function.evaluate()
        return self._state

    def fresh(self, lengths_m: Array) -> tuple[Array, Array]:
        """Tip transform (4, 4) and Jacobian (6, n_chambers), in arrays that belong to the caller.

        As :meth:`evaluate` in everything else.
        """
        if lengths_m.shape != self._shape:
            self._refuse(lengths_m)
        self._lengths[...] = lengths_m
        self._function.evaluate()
        return self._transform.copy(), self._jacobian.copy()

    def _refuse(self, lengths_m: Array) -> None:
        raise InvalidInput(f"lengths_m has the shape {lengths_m.shape}: {self._shape} is needed")

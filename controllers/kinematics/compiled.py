"""Tip pose and Jacobian of a whole arm, compiled with CasADi for the tick.

The same singularity-free form as :mod:`controllers.kinematics.constant_curvature`, written once
more in CasADi symbols so that its derivative is exact; the tests hold the two against each other.
"""

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from controllers.arm import CHAMBER_ANGLES_RAD, Arm, Array

#: Below this theta^2 (rad^2) S and C are summed as series; above, closed form. Both hold here.
_SERIES_BELOW = 0.5
_TERMS = 10


@dataclass(frozen=True)
class TipState:
    """What the tip does for given lengths. Views into buffers: valid until the next evaluation.

    ``position_m`` (3,), ``rotation`` (3, 3) from the twist-free tip frame to the base, and
    ``jacobian`` (6, n_chambers): linear rows (m/m) over angular rows (rad/m), in the base frame,
    with respect to the chamber lengths in C order.
    """

    position_m: Array
    rotation: Array
    jacobian: Array


def smooth_s_and_c(theta_squared: ca.SX) -> tuple[ca.SX, ca.SX]:
    """``S = sin(theta)/theta`` and ``C = (1 - cos(theta))/theta^2``, smooth at the straight arm."""
    small = theta_squared < _SERIES_BELOW
    safe = ca.if_else(small, 1.0, theta_squared)
    theta = ca.sqrt(safe)
    closed_s, closed_c = ca.sin(theta) / theta, (1.0 - ca.cos(theta)) / safe
    series_s, series_c = ca.SX(0.0), ca.SX(0.0)
    factorial = 1.0
    for k in range(_TERMS):
        factorial *= max(2 * k, 1) * (2 * k + 1)  # (2k+1)!
        series_s += (-theta_squared) ** k / factorial
        series_c += (-theta_squared) ** k / (factorial * (2 * k + 2))
    return ca.if_else(small, series_s, closed_s), ca.if_else(small, series_c, closed_c)


def symbolic_section(arc_length: ca.SX, u: ca.SX, v: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Position (3) and rotation (3, 3) of a section's tip in its base, in CasADi symbols."""
    theta_squared = u * u + v * v
    s, c = smooth_s_and_c(theta_squared)
    position = arc_length * ca.vertcat(u * c, v * c, s)
    rotation = ca.vertcat(
        ca.horzcat(1 - u * u * c, -u * v * c, u * s),
        ca.horzcat(-u * v * c, 1 - v * v * c, v * s),
        ca.horzcat(-u * s, -v * s, 1 - theta_squared * c),
    )
    return position, rotation


def symbolic_tip(arm: Arm, lengths: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Position and rotation of the tip in the base, for ``lengths`` (n_chambers) in C order."""
    position, rotation = ca.SX.zeros(3), ca.SX.eye(3)
    cosines, sines = np.cos(CHAMBER_ANGLES_RAD), np.sin(CHAMBER_ANGLES_RAD)
    for index, section in enumerate(arm.sections):
        chambers = lengths[3 * index : 3 * index + 3]
        factor = -2.0 / (3.0 * section.chamber_offset_m)
        step, turn = symbolic_section(
            ca.sum1(chambers) / 3.0,
            factor * ca.dot(chambers, ca.DM(cosines)),
            factor * ca.dot(chambers, ca.DM(sines)),
        )
        position = position + rotation @ step
        rotation = rotation @ turn
    return position, rotation


def _angular_jacobian(rotation: ca.SX, lengths: ca.SX) -> ca.SX:
    """Rows of the angular velocity: the axial vector of ``dR R^T`` for every length."""
    derivative = ca.jacobian(ca.vec(rotation), lengths)
    columns = []
    for index in range(lengths.numel()):
        spin = ca.reshape(derivative[:, index], 3, 3) @ rotation.T
        columns.append(ca.vertcat(spin[2, 1], spin[0, 2], spin[1, 0]))
    return ca.horzcat(*columns)


class CompiledKinematics:
    """Tip pose and Jacobian through CasADi's buffer interface: about a microsecond a call."""

    def __init__(self, arm: Arm) -> None:
        lengths = ca.SX.sym("lengths", arm.n_chambers)
        position, rotation = symbolic_tip(arm, lengths)
        jacobian = ca.vertcat(ca.jacobian(position, lengths), _angular_jacobian(rotation, lengths))
        dense = [ca.densify(expression) for expression in (position, rotation, jacobian)]
        self._function = ca.Function("tip", [lengths], dense)
        buffer: Any  # CasADi's stubs do not know its own default arguments
        buffer, self._evaluate = self._function.buffer()
        self._buffer = buffer
        self._lengths = np.zeros(arm.n_chambers)
        # CasADi is column-major: the transposed C-order arrays are the matrices themselves.
        self._outputs = [np.zeros(3), np.zeros((3, 3)), np.zeros((arm.n_chambers, 6))]
        self._buffer.set_arg(0, self._lengths.data)
        for index, output in enumerate(self._outputs):
            self._buffer.set_res(index, output.data)
        self._state = TipState(self._outputs[0], self._outputs[1].T, self._outputs[2].T)

    def evaluate(self, lengths_m: Array) -> TipState:
        """Evaluate at ``lengths_m`` (n_sections, 3). The result's arrays are reused next time."""
        self._lengths[:] = lengths_m.reshape(-1)
        self._evaluate()
        return self._state

"""A chain of sub-segments and its lumps, compiled with CasADi for the simulator's step.

Each sub-segment is a short arc with coordinates ``(L, u, v)`` as in
:mod:`pneuarm.controllers.kinematics.constant_curvature`: its own length (m) and bending vector
(rad). A lump sits at the far end of each. Since every sub-segment bends by itself, the whole is no
arc.
"""

from dataclasses import dataclass

import casadi as ca

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.geometry.compiled_function import CompiledFunction
from pneuarm.controllers.kinematics.compiled import symbolic_section


def _segment() -> ca.Function:
    """Step (3), turn (3, 3) and their rates (3, 3 each) over ``(L, u, v)`` of a sub-segment."""
    shape = ca.SX.sym("shape", 3)
    step, turn = symbolic_section(shape[0], shape[1], shape[2])
    turn_rates = ca.jacobian(ca.vec(turn), shape)
    spins = []
    for index in range(3):
        spin = ca.reshape(turn_rates[:, index], 3, 3) @ turn.T
        spins.append(ca.vertcat(spin[2, 1], spin[0, 2], spin[1, 0]))
    return ca.Function(
        "segment", [shape], [step, turn, ca.jacobian(step, shape), ca.horzcat(*spins)]
    )


@dataclass
class _Symbols:
    """What the walk along the chain collects, one entry a lump; all in the base frame."""

    positions: list[ca.SX]
    velocities: list[ca.SX]
    spins: list[ca.SX]
    linear: list[ca.SX]
    angular: list[ca.SX]
    tip_rotation: ca.SX


def _walk(shapes: ca.SX, rates: ca.SX) -> _Symbols:
    """Follow the chain from the base: where each lump is, and how it moves at the rates."""
    segment = _segment()
    position, velocity, spin = ca.SX.zeros(3), ca.SX.zeros(3), ca.SX.zeros(3)
    walked = _Symbols([], [], [], [], [], ca.SX.eye(3))
    for first in range(0, shapes.numel(), 3):
        step, turn, linear, angular = segment(shapes[first : first + 3])
        rotation, rate = walked.tip_rotation, rates[first : first + 3]
        walked.linear.append(rotation @ linear)
        walked.angular.append(rotation @ angular)
        velocity = velocity + ca.cross(spin, rotation @ step) + walked.linear[-1] @ rate
        spin = spin + walked.angular[-1] @ rate
        position = position + rotation @ step
        walked.positions.append(position)
        walked.velocities.append(velocity)
        walked.spins.append(spin)
        walked.tip_rotation = rotation @ turn
    return walked


def _jacobian(walked: _Symbols) -> ca.SX:
    """Jacobian (6 n, 3 n) of the lumps: all linear rows, then all angular rows."""
    n = len(walked.positions)
    linear, angular = ca.SX(3 * n, 3 * n), ca.SX(3 * n, 3 * n)
    for node in range(n):
        rows = slice(3 * node, 3 * node + 3)
        for joint in range(node + 1):
            columns = slice(3 * joint, 3 * joint + 3)
            lever = ca.skew(walked.positions[node] - walked.positions[joint])
            linear[rows, columns] = walked.linear[joint] - lever @ walked.angular[joint]
            angular[rows, columns] = walked.angular[joint]
    return ca.vertcat(linear, angular)


def _imposed(
    walked: _Symbols, shapes: ca.SX, rates: ca.SX, gravity_m_s2: tuple[float, float, float]
) -> ca.SX:
    """Gravity less what the lumps accelerate at steady rates, (6 n): linear, then angular."""
    n = len(walked.positions)
    fall = ca.vertcat(ca.repmat(ca.DM(gravity_m_s2), n, 1), ca.DM.zeros(3 * n))
    motion = ca.vertcat(*walked.velocities, *walked.spins)
    return fall - ca.jtimes(motion, shapes, rates)


class Chain:
    """``n`` sub-segments in series under a gravity (m/s^2, base frame); coordinates (3 n,).

    ``weights`` (6 n,) are the square roots of the lumps' inertias: masses three times each, then
    moments. With them the Jacobian ``S`` gives the mass matrix ``S S^T``, and the acceleration
    ``a`` that gravity and the curved coordinates impose gives the generalised force ``S a``.
    """

    def __init__(self, n_segments: int, gravity_m_s2: tuple[float, float, float]) -> None:
        size = 3 * n_segments
        shapes, rates = ca.SX.sym("shapes", size), ca.SX.sym("rates", size)
        weights = ca.SX.sym("weights", 2 * size)
        walked = _walk(shapes, rates)
        jacobian = ca.repmat(weights, 1, size) * _jacobian(walked)
        imposed = weights * _imposed(walked, shapes, rates, gravity_m_s2)
        pose = [ca.horzcat(*walked.positions), walked.tip_rotation]
        self.n_segments = n_segments
        self._dynamics = CompiledFunction(
            "dynamics", [shapes, rates, weights], [jacobian.T, imposed]
        )
        self._pose = CompiledFunction("pose", [shapes], [part.T for part in pose])

    def dynamics(self, shapes: Array, rates: Array, weights: Array) -> tuple[Array, Array]:
        """Return ``S`` (3 n, 6 n) and ``a`` (6 n,); valid until the next call."""
        weighted_jacobian, acceleration = self._dynamics(shapes, rates, weights)
        return weighted_jacobian, acceleration

    def pose(self, shapes: Array) -> tuple[Array, Array]:
        """Return the lumps' positions (n, 3), the last is the tip, and the tip's rotation (3, 3).

        Both in the base frame (m), and valid until the next call.
        """
        positions, transposed = self._pose(shapes)
        return positions, transposed.T

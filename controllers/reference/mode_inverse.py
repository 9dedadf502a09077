"""How far ahead of the tip the law is to be, so that a body with a lowest mode is at the tip.

The inverse of the mode, ``u = q + (2 zeta / omega) q' + (1 / omega^2) q''``, holds for what bends a
section; what lengthens it follows at once. On the tip itself it would hold for a tip that goes
straight ahead as the chambers lengthen. It does not: a tip that is swung further out comes nearer
to the base as well.
"""

import casadi as ca

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.geometry.compiled_function import CompiledFunction
from pneuarm.controllers.kinematics.compiled import symbolic_tip

#: Where the tip cannot move a way, it is not led that way: singular values of its Jacobian (m/m)
#: well below this count as none.
_DAMPING = 0.05


class ModeInverse:
    """The way from a moving tip to where the law is to be, by the kinematics of an arm.

    ``by_rate_s`` and ``by_acceleration_s2`` are the two coefficients of the inverse.
    """

    def __init__(self, arm: Arm, by_rate_s: float, by_acceleration_s2: float) -> None:
        lengths = ca.SX.sym("lengths", arm.n_chambers)
        velocity, acceleration = ca.SX.sym("velocity", 3), ca.SX.sym("acceleration", 3)
        tip = _Tip(arm)

        def bent(at: ca.SX, turning: ca.SX) -> ca.SX:
            rates = tip.rates(at, velocity)
            changes = tip.rates(at, acceleration - turning)
            return _bending(by_rate_s * rates + by_acceleration_s2 * changes)

        # What is commanded is ahead already; the arm itself is behind it.
        behind = lengths - bent(lengths, ca.SX.zeros(3))
        ahead = behind + bent(behind, tip.turning(behind, tip.rates(behind, velocity)))
        self._way = CompiledFunction(
            "mode_inverse",
            [lengths, velocity, acceleration],
            [tip.position(ahead) - tip.position(behind)],
        )

    def way_m(self, velocity_m_s: Array, acceleration_m_s2: Array, lengths_m: Array) -> Array:
        """From the tip to where the law is to be (3,), at commanded lengths (n_sections, 3)."""
        return self._way(lengths_m, velocity_m_s, acceleration_m_s2)[0].copy()


class _Tip:
    """Position of an arm's tip and its derivatives, in symbols."""

    def __init__(self, arm: Arm) -> None:
        lengths, rates = (ca.SX.sym(name, arm.n_chambers) for name in ("lengths", "rates"))
        position, _, jacobian = symbolic_tip(arm, lengths)
        twice = ca.jtimes(ca.jtimes(position, lengths, rates), lengths, rates)
        self.position = ca.Function("position", [lengths], [position])
        self._jacobian = ca.Function("jacobian", [lengths], [jacobian[:3, :]])
        #: Acceleration (3,) of the tip at steady rates.
        self.turning = ca.Function("turning", [lengths, rates], [twice])

    def rates(self, lengths: ca.SX, velocity: ca.SX) -> ca.SX:
        """Least rates (n_chambers,) that move the tip with a velocity (3,)."""
        jacobian = self._jacobian(lengths)
        square = jacobian @ jacobian.T + _DAMPING**2 * ca.SX.eye(3)
        rates: ca.SX = jacobian.T @ ca.solve(square, velocity)
        return rates


def _bending(lengths: ca.SX) -> ca.SX:
    """What of changes of lengths (n_chambers,) bends sections: without each section's mean."""
    each = ca.reshape(lengths, 3, -1)
    bent: ca.SX = ca.vec(each - ca.repmat(ca.sum1(each) / 3.0, 3, 1))
    return bent

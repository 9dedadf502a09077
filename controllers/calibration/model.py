"""Where the tip is for given pressures and parameters, and its exact derivative over both.

The lengths are implicit in the parameters (the arm hangs as its weight bends it): Newton's method
finds them, the implicit function theorem differentiates them. All of it is CasADi's, over batches.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from pneuarm.controllers.actuation.symbols import symbolic_lengthening, symbolic_unloaded
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.calibration.parameters import SHAPING, symbolic_arm
from pneuarm.controllers.kinematics.compiled import symbolic_tip

_NEWTON_STEPS = 15
_CONVERGED_M = 1e-9


@dataclass(frozen=True)
class Tips:
    """A batch of tips: ``pose`` (batch, 12), position and then rotation row by row.

    ``over_theta`` (batch, 12, n_sections * SHAPING) and ``over_pressure`` (batch, 12, n_chambers).
    """

    pose: Array
    over_theta: Array
    over_pressure: Array


class TipModel:
    """The calibrated arm with its parameters open."""

    def __init__(self, arm: Arm) -> None:
        n = arm.n_chambers
        lengths, pressures = ca.SX.sym("lengths", n), ca.SX.sym("pressures", n)
        flat = ca.SX.sym("theta", arm.n_sections * SHAPING)
        open_arm = symbolic_arm(arm, ca.reshape(flat, SHAPING, arm.n_sections).T)
        rest = ca.vertcat(*(ca.repmat(s.rest_length_m, 3, 1) for s in open_arm.sections))
        goal = rest + symbolic_lengthening(open_arm, pressures)
        residual = symbolic_unloaded(open_arm, lengths) - goal
        over_lengths = ca.jacobian(residual, lengths)
        position, rotation, _ = symbolic_tip(open_arm, lengths)
        pose = ca.vertcat(position, ca.reshape(rotation.T, 9, 1))
        inputs = [lengths, pressures, flat]
        step = ca.solve(over_lengths, residual)
        implicit = -ca.solve(over_lengths, ca.jacobian(residual, ca.vertcat(flat, pressures)))
        total = ca.jacobian(pose, lengths) @ implicit
        total += ca.jacobian(pose, ca.vertcat(flat, pressures))
        self._goal = ca.Function("goal", [pressures, flat], [goal])
        self._step = ca.Function("step", inputs, ca.cse([step]))
        self._pose = ca.Function("pose", [lengths, flat], ca.cse([pose]))
        self._tip = ca.Function("tip", inputs, ca.cse([pose, ca.densify(total)]))
        self._n_theta = flat.numel()

    def tips(self, pressures_pa: Array, theta: Array) -> Tips:
        """Tips of a batch of pressures (batch, n_sections, 3) at parameters (n_sections, ...)."""
        batch = len(pressures_pa)
        columns = pressures_pa.reshape(batch, -1).T
        flat = theta[:, :SHAPING].reshape(-1)
        lengths = self._lengths(columns, flat)
        pose, total = (np.asarray(each) for each in self._tip(lengths, columns, flat))
        total = total.reshape(12, batch, -1).transpose(1, 0, 2)
        return Tips(pose.T, total[:, :, : self._n_theta], total[:, :, self._n_theta :])

    def poses(self, pressures_pa: Array, theta: Array) -> Array:
        """Poses (batch, 12) as in :class:`Tips`, without their derivatives."""
        columns = pressures_pa.reshape(len(pressures_pa), -1).T
        flat = theta[:, :SHAPING].reshape(-1)
        return np.asarray(self._pose(self._lengths(columns, flat), flat)).T

    def _lengths(self, columns: Array, flat: Array) -> Array:
        """Loaded lengths (n_chambers, batch); unloaded ones where Newton does not converge."""
        goal = np.asarray(self._goal(columns, flat))
        lengths = goal.copy()
        for _ in range(_NEWTON_STEPS):
            step = np.asarray(self._step(lengths, columns, flat))
            lengths -= step
            if np.abs(step).max() < _CONVERGED_M:
                return lengths
        return np.where(np.abs(step).max(axis=0) < _CONVERGED_M, lengths, goal)

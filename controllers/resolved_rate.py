"""Resolved-rate control with a damped Jacobian."""

import numpy as np

from controllers.arm import Array
from controllers.kinematics.compiled import TipState
from controllers.law import LawStep, Limits, clamped_step
from controllers.tasks.task import Task

#: Damping of the pseudo-inverse, in the Jacobian's units (m/m): small beside its usual 0.5 to 3.
DAMPING = 0.02


class ResolvedRate:
    """``dq = J^T (J J^T + damping^2 I)^-1 rate dt``, slowed to the rate limit and clipped."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits

    def step(self, task: Task, tip: TipState, lengths_m: Array, dt_s: float) -> LawStep:
        """Return lengths one tick later, strictly inside the limits."""
        rate, jacobian = task.rate_and_jacobian(tip, lengths_m)
        gram = jacobian @ jacobian.T
        gram.flat[:: gram.shape[0] + 1] += DAMPING**2
        step = jacobian.T @ np.linalg.solve(gram, rate * dt_s)
        return LawStep(clamped_step(self._limits, lengths_m, step, dt_s))

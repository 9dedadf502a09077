"""Resolved-rate control with a damped Jacobian."""

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.laws.solve_ik import IkProblem

#: A singular value of the Jacobian (m/m) above this is far from singular: no damping at all.
NEAR_SINGULAR = 0.1

#: Damping of a singular value of 0.
DAMPING = 0.05


#: A step that is turned aside by less than this part of the largest rate counts as untouched.
_TOUCHED = 1e-3


class ResolvedRate:
    """``dq = base + J^+ (rate dt - J base)``, with J^+ damped only near a singularity.

    The damping of one direction grows from 0 at NEAR_SINGULAR to DAMPING where the arm cannot move
    that way at all: ``damping^2 = DAMPING^2 (1 - (sigma / NEAR_SINGULAR)^2)`` (Nakamura, Hanafusa).
    """

    def wish(self, problem: IkProblem) -> Array | None:
        """Return rates (n_chambers,) in units of the largest ones; None if they are not finite."""
        if not np.isfinite(problem.checks[1]):
            return None  # else numpy warns of it, and then raises
        jacobian, base = problem.jacobian, problem.base
        rate = problem.rate - jacobian @ base
        squares, directions = np.linalg.eigh(jacobian @ jacobian.T)
        damping = DAMPING**2 * np.maximum(0.0, 1.0 - squares / NEAR_SINGULAR**2)
        along = (directions.T @ rate) / (np.maximum(squares, 0.0) + damping)
        step: Array = base + jacobian.T @ (directions @ along)
        step = slowed(step)
        beside = clamped(step, problem)
        if np.abs(beside - step).max() < _TOUCHED:
            return beside
        # Cut off, the inverse may lead away from the goal; along the steepest descent it cannot.
        return clamped(slowed(base + jacobian.T @ rate), problem)


def slowed(step: Array) -> Array:
    """Scale a step (n,) to the largest rate: else it is turned aside far from any limit."""
    return step / max(1.0, float(np.abs(step).max()))


def clamped(step: Array, problem: IkProblem) -> Array:
    """Turn a step (n,) aside where it leaves the rows: one after the other, the chambers' last."""
    n = step.size
    for row, upper in zip(problem.A[n:], problem.upper[n:], strict=True):
        beyond = float(row @ step) - upper
        if beyond > 0.0:
            step = step - row * (beyond / max(float(row @ row), 1e-12))
    return np.clip(step, problem.lower[:n], problem.upper[:n])

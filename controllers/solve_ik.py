"""One step of differential inverse kinematics as a QP: build_ik makes it, IkSolver solves it.

    minimise    |J dq - rate dt|^2 + damping |dq|^2
    subject to  lower <= G dq <= upper        (one block of rows a limit)

The unknown is ``x = dq / step``, with ``step`` the largest step of a chamber in one tick, and the
cost is divided by ``step^2``, the rows by ``step``: all entries are then near 1, without which
OSQP runs into its iteration limit. rho is fixed, because its adaptation makes results depend on
timing.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import osqp
import scipy.sparse as sparse

from controllers.arm import Array
from controllers.limits.limit import Limit

#: Weight of ``|x|^2`` beside the task: small against J^T J, large enough to keep P well posed.
#: With 1e-3 the trunk chatters at full rate before targets out of reach, and OSQP gives up in 5 %
#: of the ticks; with 3e-2 it comes to rest there, and the way to reachable targets takes no longer.
DAMPING = 3e-2

#: Largest violation of a row (in units of the largest step) at which a result is still taken.
ACCEPTED_VIOLATION = 1e-3

_SETTINGS = {
    "verbose": False,
    "adaptive_rho": False,
    "rho": 0.3,
    "scaling": 0,
    "polishing": False,
    "warm_starting": True,
    "eps_abs": 1e-5,
    "eps_rel": 1e-5,
    "max_iter": 400,
    "check_termination": 5,
}


@dataclass(frozen=True)
class IkProblem:
    """``minimise 1/2 x^T P x + q^T x`` subject to ``lower <= A x <= upper``; ``dq = step x``."""

    P: Array
    q: Array
    A: Array
    lower: Array
    upper: Array
    step_m: Array

    def violation(self, x: Array) -> float:
        """Largest violation of a row at x."""
        rows = self.A @ x
        return float(np.maximum(self.lower - rows, rows - self.upper).max())


def build_ik(
    rate: Array,
    jacobian: Array,
    limits: Sequence[Limit],
    lengths_m: Array,
    step_m: Array,
    dt_s: float,
) -> IkProblem:
    """Put a task's rate (m,) and Jacobian (m, n_chambers) and the limits' rows into one QP.

    ``step_m`` (n_chambers,) is the largest step of each chamber in one tick.
    """
    scale = float(step_m.max())
    scaled = jacobian * (step_m / scale)
    cost = scaled.T @ scaled
    cost.flat[:: cost.shape[0] + 1] += DAMPING
    linear = scaled.T @ (rate * (-dt_s / scale))
    blocks = [limit.rows(lengths_m, dt_s) for limit in limits]
    return IkProblem(
        cost,
        linear,
        np.concatenate([rows for rows, _, _ in blocks]) * (step_m / scale),
        np.concatenate([lower for _, lower, _ in blocks]) / scale,
        np.concatenate([upper for _, _, upper in blocks]) / scale,
        step_m,
    )


class IkSolver:
    """OSQP with a persistent workspace, called through its extension object.

    The Python wrapper costs more than the solution itself at this size.
    """

    def __init__(self, n_chambers: int, limits: Sequence[Limit]) -> None:
        pattern = np.concatenate([limit.pattern for limit in limits]) != 0.0
        self._a_columns = np.ascontiguousarray(pattern.T)
        self._p_columns = np.tri(n_chambers, dtype=bool)
        cost = sparse.csc_matrix(np.triu(np.ones((n_chambers, n_chambers))) + np.eye(n_chambers))
        rows = sparse.csc_matrix(pattern.astype(float))
        infinite = np.full(pattern.shape[0], np.inf)
        solver = osqp.OSQP(algebra="builtin")
        solver.setup(cost, np.zeros(n_chambers), rows, -infinite, infinite, **_SETTINGS)
        self._solver = solver._solver
        self._solved = int(osqp.SolverStatus.OSQP_SOLVED)
        self._infinity = solver.constant("OSQP_INFTY")
        self._zeros = (np.zeros(n_chambers), np.zeros(pattern.shape[0]))

    def solve(self, problem: IkProblem) -> Array | None:
        """Return the step dq (n_chambers,) in metres, or None if no result can be trusted.

        A result counts only if OSQP calls it solved, it is finite and it respects the rows: an
        infeasible problem comes back as finite numbers near 2e9.
        """
        # A sum of squares is finite only if every element is.
        flat = (problem.q, problem.P.reshape(-1), problem.A.reshape(-1))
        if not math.isfinite(sum(float(values @ values) for values in flat)):
            return None  # a NaN would poison the warm start of every later solve
        self._update(problem)
        self._solver.solve()
        x = np.array(self._solver.solution.x)
        accepted = self._solver.info.status_val == self._solved and math.isfinite(x @ x)
        if accepted and problem.violation(x) <= ACCEPTED_VIOLATION:
            return x * problem.step_m
        self._solver.warm_start(*self._zeros)
        return None

    def _update(self, problem: IkProblem) -> None:
        self._solver.update_data_vec(
            q=problem.q,
            l=np.maximum(problem.lower, -self._infinity),
            u=np.minimum(problem.upper, self._infinity),
        )
        self._solver.update_data_mat(
            P_x=problem.P[self._p_columns],
            P_i=None,
            A_x=problem.A.T[self._a_columns],
            A_i=None,
        )

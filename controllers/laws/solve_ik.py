"""One step of differential inverse kinematics as a QP: IkBuilder makes it, IkSolver solves it.

    minimise    |J dq - rate dt|^2 + damping |dq - base|^2
    subject to  lower <= G dq <= upper        (what the limits leave, linearised)

The unknown is ``x = dq / step``, with ``step`` the largest step of a chamber in one tick, and the
rows are in the same unit: all entries are then near 1, without which OSQP runs into its iteration
limit. rho is fixed, because its adaptation makes results depend on timing.

Only limits on where the arm may be are rows: they turn the step aside, so that the arm slides along
them. Limits on how fast it may go slow the step down as a whole, afterwards, in
:mod:`pneuarm.controllers.laws.safe_step`: a straight line stays straight.
"""

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np
import osqp
import scipy.sparse as sparse

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.geometry.compiled_function import CompiledFunction
from pneuarm.controllers.limits.limits import Limits
from pneuarm.controllers.targets.targets import PARTS, ROWS
from pneuarm.controllers.tasks.rows import Parts, symbolic_rows
from pneuarm.controllers.tasks.wanted import symbols

#: Weight of ``|x|^2`` beside the task: small against J^T J, large enough to keep P well posed. With
#: 1e-2 the trunk needs 285 of OSQP's iterations in one of 100 ticks at its limits, so 100.
DAMPING = 5e-2

#: The same where the null space of the tasks is cut out for the posture.
_NULL_DAMPING = 1e-6

#: A posture at its bound goes back at this share of the largest rate.
_POSTURE_SHARE = 0.25

#: A far target pulls as hard as this many times the largest speed of the tip would take.
_PULL = 4.0


_TINY = 1e-12
_INFINITY = 1e30

_SETTINGS = {
    "verbose": False,
    "adaptive_rho": False,
    "rho": 1.5,
    "scaling": 0,
    "polishing": False,
    "warm_starting": True,
    "eps_abs": 2e-5,
    "eps_rel": 2e-5,
    "max_iter": 1000,
    "check_termination": 5,
}


@dataclass(frozen=True)
class IkProblem:
    """``minimise 1/2 x^T P x + q^T x`` subject to ``lower <= A x <= upper``; ``dq = step x``.

    ``P_upper`` and ``A_data`` are OSQP's: the upper triangle of P and the non-zeros of A, column by
    column. ``jacobian`` (m, n), ``rate`` (m,) and ``base`` (n,) are what the cost is made of, in
    the same units. ``free`` (n,) is the solution if no row were there. ``checks`` (3,): how far
    ``free`` is beyond a row, a number that is finite only if everything else is, and which share of
    the rate is feedback. The arrays are views that the next build overwrites.
    """

    P_upper: Array
    q: Array
    A_data: Array
    lower: Array
    upper: Array
    jacobian: Array
    rate: Array
    base: Array
    free: Array
    checks: Array
    A_pattern: sparse.csc_matrix

    @property
    def P(self) -> Array:  # noqa: N802
        """Return the matrix (n, n) of the cost, whole."""
        n = self.q.size
        cost = np.zeros((n, n))
        cost[np.tri(n, dtype=bool)] = self.P_upper  # its transpose, row by row
        return np.tril(cost) + np.tril(cost, -1).T

    @property
    def A(self) -> Array:  # noqa: N802
        """Return the rows (k, n), whole."""
        pattern = self.A_pattern
        whole = sparse.csc_matrix((self.A_data, pattern.indices, pattern.indptr), pattern.shape)
        rows: Array = whole.toarray()
        return rows

    def violation(self, x: Array) -> float:
        """Largest violation of a row at x."""
        rows = self.A @ x
        return float(np.maximum(self.lower - rows, rows - self.upper).max())


class IkBuilder:
    """The compiled function that makes the whole problem in one call.

    The arguments are arrays that the caller owns and changes in place: ``lengths_m`` and
    ``rates_m_s`` (n_chambers,), the vector of what is wanted, and ``dt_s`` (1,).
    """

    def __init__(self, arm: Arm, limits: Limits, whole: bool) -> None:
        self._arm, self._limits = arm, limits
        self._rate_max = ca.DM(arm.per_chamber("length_rate_max_m_s").reshape(-1))
        self._acceleration = ca.DM(arm.per_chamber("length_acceleration_max_m_s2").reshape(-1))
        lengths, rates = (ca.SX.sym(name, arm.n_chambers) for name in ("lengths", "rates"))
        vector, want = symbols(arm.n_chambers, PARTS)
        dt = ca.SX.sym("dt")
        jacobian, rate, base, damping, by_feedback = self._cost(lengths, dt, want, whole)
        cost = jacobian.T @ jacobian + damping * ca.SX.eye(arm.n_chambers)
        linear = -(jacobian.T @ rate + damping * base)
        rows, lower, upper = self._rows(lengths, rates, dt, want["gain_per_s"])
        upper_triangle = ca.vertcat(*(cost[: k + 1, k] for k in range(arm.n_chambers)))
        free = base + jacobian.T @ _solve(
            jacobian @ jacobian.T + damping * ca.SX.eye(jacobian.shape[0]),
            rate - jacobian @ base,
        )
        beyond = ca.mmax(ca.vertcat(rows @ free - upper, lower - rows @ free))
        finite = ca.sumsqr(free) + ca.sumsqr(upper_triangle) + ca.sumsqr(linear) + ca.sumsqr(rows)
        finite += ca.sum1(lower) + ca.sum1(upper)
        pattern = ca.DM.ones(rows.sparsity())
        self.pattern = sparse.csc_matrix(pattern.sparse())
        self.function = CompiledFunction(
            "ik",
            [lengths, rates, vector, dt],
            [
                upper_triangle,
                linear,
                _nonzeros(rows),
                lower,
                upper,
                jacobian,
                rate,
                base,
                free,
                ca.vertcat(beyond, finite, by_feedback),
            ],
        )
        self.problem = IkProblem(*self.function.results, A_pattern=self.pattern)  # type: ignore[misc]

    def _cost(
        self, lengths: ca.SX, dt: ca.SX, want: Parts, whole: bool
    ) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX, ca.SX]:
        """Jacobian (m, n), rate (m,), base (n,), damping, and the share that is feedback."""
        largest = ca.mmax(self._rate_max)
        step, scale = self._rate_max * dt, largest * dt
        rows = symbolic_rows(self._arm, lengths, want, ROWS, whole)
        jacobian = rows.jacobian @ ca.diag(self._rate_max / largest)
        damping = ca.fmax(want["lengths_weight"], DAMPING)
        chambers = want["lengths_weight"] / damping * (want["lengths_m"] - lengths) / step
        # A far target may pull hard: where a limit holds the arm, little is left along it.
        speed = _PULL * want["speed_max_m_s"] / (ca.norm_2(rows.error) + _TINY)
        share = ca.fmin(dt * ca.fmin(want["gain_per_s"], speed), 1.0)
        velocity = rows.velocity / largest
        rate = share * rows.error / scale + velocity
        base = share * chambers
        fed = ca.norm_2(velocity)
        by_feedback = 1.0 - fed / (fed + share * ca.norm_2(rows.error) / scale + _TINY)
        if self._arm.n_sections > 1:
            base += self._posture(lengths, jacobian, want["posture_weight"])
        return jacobian, rate, base, damping, by_feedback

    def _posture(self, lengths: ca.SX, jacobian: ca.SX, weight: ca.SX) -> ca.SX:
        """Toward the middle of the bounds, as far as it moves no task."""
        low, high = length_bounds_m(self._arm)
        middle, half = (0.5 * values.reshape(-1) for values in (high + low, high - low))
        back = weight * _POSTURE_SHARE * (ca.DM(middle) - lengths) / ca.DM(half)
        gram = jacobian @ jacobian.T + _NULL_DAMPING * ca.SX.eye(jacobian.shape[0])
        return back - jacobian.T @ _solve(gram, jacobian @ back)

    def _rows(
        self, lengths: ca.SX, rates: ca.SX, dt: ca.SX, gain: ca.SX
    ) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Rows A (k, n), lower and upper (k,): a bound is approached like a target that lies on it.

        So a straight way to any target inside the bounds is never turned aside.
        """
        step, share = self._rate_max * dt, ca.fmin(gain * dt, 1.0)
        smallest = ca.mmin(step)
        chambers: list[tuple[ca.SX, ca.SX]] = []
        rows: list[tuple[ca.SX, ca.SX, ca.SX]] = []
        # Where the arm could stop: along a curved bound the way there counts, not the place.
        stop = lengths + rates * (0.5 * ca.mmax(ca.fabs(rates) / self._acceleration))
        for limit in self._limits:
            slack = limit.slack(lengths)
            slope = ca.jacobian(slack, lengths)
            if limit.two_sided:
                n = slack.numel() // 2
                bound = limit.approach(slack, share)
                below, above = -bound[:n], ca.fmax(bound[n:], -bound[:n])
                if _is_diagonal(slope[:n, :]):
                    own = ca.diag(slope[:n, :])
                    chambers.append((below / own, above / own))
                else:
                    rows.append((slope[:n, :] @ ca.diag(step) / step, below / step, above / step))
            else:
                slack, slope = (ca.substitute(part, lengths, stop) for part in (slack, slope))
                bound = limit.approach(slack, share) / smallest
                none = ca.SX.ones(bound.shape) * -_INFINITY
                rows.append((-slope @ ca.diag(step) / smallest, none, bound))
        lower, upper = _intersection(chambers)
        rows.insert(0, (ca.SX.eye(self._arm.n_chambers), lower / step, upper / step))
        matrix, least, most = (ca.vertcat(*parts) for parts in zip(*rows, strict=True))
        return matrix, least, most


def _is_diagonal(matrix: ca.SX) -> bool:
    """Whether every row depends on its own chamber alone."""
    rows, columns = matrix.sparsity().get_triplet()
    return list(rows) == list(columns)


def _intersection(bounds: list[tuple[ca.SX, ca.SX]]) -> tuple[ca.SX, ca.SX]:
    """Bounds (n,) that respect all of them; where they exclude each other, the lower ones."""
    lower, upper = bounds[0]
    for low, high in bounds[1:]:
        lower, upper = ca.fmax(lower, low), ca.fmin(upper, high)
        upper = ca.fmax(upper, lower)
    return lower, upper


def _nonzeros(matrix: ca.SX) -> ca.SX:
    """Non-zeros of a matrix as a vector, column by column."""
    return ca.SX(ca.Sparsity.dense(matrix.nnz()), matrix.nz[:])


def _solve(gram: ca.SX, right: ca.SX) -> ca.SX:
    """Solve a small positive definite system by Cholesky's factorisation."""
    factor = ca.chol(gram)  # upper: gram = factor^T factor
    size = gram.shape[0]
    forward: list[ca.SX] = []
    for row in range(size):
        known = sum((factor[k, row] * forward[k] for k in range(row)), ca.SX(0))
        forward.append((right[row] - known) / factor[row, row])
    solution: list[ca.SX] = [ca.SX(0)] * size
    for row in reversed(range(size)):
        known = sum((factor[row, k] * solution[k] for k in range(row + 1, size)), ca.SX(0))
        solution[row] = (forward[row] - known) / factor[row, row]
    return ca.vertcat(*solution)


class IkSolver:
    """OSQP with a persistent workspace, called through its extension object.

    The Python wrapper costs more than the solution itself at this size.
    """

    def __init__(self, n_chambers: int, pattern: sparse.csc_matrix) -> None:
        cost = sparse.csc_matrix(np.triu(np.ones((n_chambers, n_chambers))) + np.eye(n_chambers))
        infinite = np.full(pattern.shape[0], _INFINITY)
        solver = osqp.OSQP(algebra="builtin")
        solver.setup(cost, np.zeros(n_chambers), pattern, -infinite, infinite, **_SETTINGS)
        self._solver = solver._solver
        self._solved = int(osqp.SolverStatus.OSQP_SOLVED)
        self.asked = 0
        self._zeros = (np.zeros(n_chambers), np.zeros(pattern.shape[0]))

    def solve(self, problem: IkProblem) -> Array | None:
        """Return x (n_chambers,), or None if no result can be trusted.

        A result counts only if OSQP calls it solved and it is finite: an infeasible problem comes
        back as finite numbers near 2e9. Whether it respects the limits is checked, exactly, on the
        lengths that it leads to.
        """
        beyond, finite, _ = problem.checks.tolist()
        if not math.isfinite(finite):
            return None  # a NaN would poison the warm start of every later solve
        if beyond <= 0.0:
            return problem.free  # no row is in the way: this is the solution, to the last digit
        self.asked += 1
        solver = self._solver
        solver.update_data_vec(q=problem.q, l=problem.lower, u=problem.upper)
        solver.update_data_mat(P_x=problem.P_upper, P_i=None, A_x=problem.A_data, A_i=None)
        solver.solve()
        if solver.info.status_val == self._solved:
            x: Array = solver.solution.x
            if math.isfinite(x @ x):
                return x
        solver.warm_start(*self._zeros)
        return None

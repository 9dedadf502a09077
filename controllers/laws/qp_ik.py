"""Inverse kinematics as a QP under limits, with a fallback that is always available."""

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.laws.resolved_rate import ResolvedRate
from pneuarm.controllers.laws.solve_ik import IkProblem, IkSolver


class QpIk:
    """Least squares of the tasks under the limits; OSQP underneath."""

    def __init__(self, solver: IkSolver) -> None:
        self._solver = solver
        self._fallback = ResolvedRate()
        self.fallbacks = 0

    def wish(self, problem: IkProblem) -> Array | None:
        """Return rates (n_chambers,); by the damped law where OSQP's result is not usable."""
        x = self._solver.solve(problem)
        if x is None:
            self.fallbacks += 1
            return self._fallback.wish(problem)
        return x

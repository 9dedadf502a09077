"""Inverse kinematics as a QP under limits, with a fallback that is always available."""

from controllers.arm import Arm, Array
from controllers.kinematics.compiled import TipState
from controllers.law import LawStep, Limits, clamped_step
from controllers.resolved_rate import ResolvedRate
from controllers.solve_ik import IkSolver, build_ik
from controllers.tasks.task import Task


class QpIk:
    """Least squares of the task under length, length rate and bend; OSQP underneath."""

    def __init__(self, arm: Arm, limits: Limits) -> None:
        self._limits = limits
        self._rows = (limits.length, limits.rate, limits.bend)
        self._solver = IkSolver(arm.n_chambers, self._rows)
        self._fallback = ResolvedRate(limits)

    def step(self, task: Task, tip: TipState, lengths_m: Array, dt_s: float) -> LawStep:
        """Return lengths one tick later; by the damped law where OSQP's result is not usable."""
        rate, jacobian = task.rate_and_jacobian(tip, lengths_m)
        largest = self._limits.rate.rate_max_m_s * dt_s
        problem = build_ik(rate, jacobian, self._rows, lengths_m, largest, dt_s)
        step = self._solver.solve(problem)
        if step is None:
            damped = self._fallback.step(task, tip, lengths_m, dt_s)
            return LawStep(damped.lengths_m, fell_back=True)
        return LawStep(clamped_step(self._limits, lengths_m, step, dt_s))

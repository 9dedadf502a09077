"""One step of the commanded chambers: tasks -> problem -> law -> safe step.

Everything that is compiled for an arm is compiled here, before the first tick.
"""

from typing import Protocol

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.compiled import TipState
from pneuarm.controllers.laws.qp_ik import QpIk
from pneuarm.controllers.laws.resolved_rate import ResolvedRate
from pneuarm.controllers.laws.safe_step import SafeStep
from pneuarm.controllers.laws.solve_ik import IkBuilder, IkProblem, IkSolver
from pneuarm.controllers.limits.limits import Limits
from pneuarm.controllers.targets.target import Target
from pneuarm.controllers.targets.targets import PARTS
from pneuarm.controllers.tasks.wanted import Wanted


class Law(Protocol):
    """A control law."""

    def wish(self, problem: IkProblem) -> Array | None:
        """Return rates (n_chambers,), in units of the largest ones, or None: no result."""
        ...


class _Compiled:
    """What one set of tasks needs: the problem and the step."""

    def __init__(self, arm: Arm, limits: Limits, whole: bool) -> None:
        self.builder = IkBuilder(arm, limits, whole)
        self.safe = SafeStep(arm, limits, whole, self.builder.problem.rate.size)


class CommandedChambers:
    """The commanded lengths and rates of an arm, and how they follow what is wanted.

    ``wanted`` is what the error is measured by; ``pursued`` is what the step follows: the same,
    unless there is a better way to it.
    """

    def __init__(self, arm: Arm) -> None:
        self._shape = (arm.n_sections, 3)
        self._lengths, self._rates = np.zeros(arm.n_chambers), np.zeros(arm.n_chambers)
        self._dt = np.full(1, 1e-3)
        self.limits = Limits(arm)
        self._correction: tuple[Array | None, Array | None] = None, None
        self.wanted, self.pursued = (Wanted(arm.n_chambers, PARTS) for _ in range(2))
        self._position_only, self._whole = (
            _Compiled(arm, self.limits, whole) for whole in (False, True)
        )
        for compiled in (self._position_only, self._whole):
            state = (self._lengths, self._rates)
            compiled.builder.function.bind([*state, self.pursued.values, self._dt])
            compiled.safe.bind(*state, self.wanted.values, self._dt, compiled.builder.problem)
        self._compiled = self._position_only
        solver = IkSolver(arm.n_chambers, self._compiled.builder.pattern)
        self.qp_ik, self.resolved_rate = QpIk(solver), ResolvedRate()
        self.place(arm.rest_lengths_m)

    @property
    def lengths_m(self) -> Array:
        """Commanded lengths (n_sections, 3), in an array of their own."""
        return self._lengths.reshape(self._shape).copy()

    @property
    def rates_m_s(self) -> Array:
        """Commanded rates (n_sections, 3), in an array of their own."""
        return self._rates.reshape(self._shape).copy()

    @property
    def tip(self) -> TipState:
        """The model's tip of the commanded lengths; its arrays are reused by the next step."""
        return self._compiled.safe.tip

    @property
    def error_m(self) -> float:
        """How far the commanded lengths are from what is wanted."""
        return self._compiled.safe.error_m

    def place(self, lengths_m: Array) -> None:
        """Stand still at lengths (n_sections, 3) within the limits."""
        self._lengths[:] = lengths_m.reshape(-1)
        self._rates[:] = 0.0
        self._compiled.safe.take(None)

    def ask(self, target: Target, gain_per_s: float, speed_max_m_s: float) -> None:
        """Follow a target from now on."""
        target.ask(self.wanted, gain_per_s, speed_max_m_s)
        compiled = self._whole if self.wanted.beyond_position else self._position_only
        if compiled is not self._compiled:
            self._compiled = compiled
            self.place_tip()
        self.pursue(None)

    def place_tip(self) -> None:
        """Bring the tip up to date with the lengths, without a step."""
        rates = self._rates.copy()
        self._rates[:] = 0.0
        self._compiled.safe.take(None)
        self._rates[:] = rates

    def correct(self, offset_m: Array, rotation: Array) -> None:
        """See the tip at ``p(q) + offset_m`` (3,) with ``rotation`` (3, 3) before the model's."""
        if offset_m is self._correction[0] and rotation is self._correction[1]:
            return  # between two measured poses nothing changes, and nobody writes into them
        self._correction = offset_m, rotation
        self.wanted.correct(offset_m, rotation)
        self.pursued.correct(offset_m, rotation)

    def pursue(self, target: Target | None) -> None:
        """Follow another target than the one that is asked for; None follows what is asked for."""
        if target is None:
            self.pursued.values[:] = self.wanted.values
        else:
            gain, speed = self.wanted["gain_per_s"][0], self.wanted["speed_max_m_s"][0]
            target.ask(self.pursued, float(gain), float(speed))

    def step(self, law: Law | None, dt_s: float) -> None:
        """Go on by one tick; without a law, brake."""
        self._dt[0] = dt_s
        compiled = self._compiled
        safe = compiled.safe
        if law is None:
            safe.take(None)
        else:
            compiled.builder.function.evaluate()
            safe.take(law.wish(compiled.builder.problem))
        self._lengths[:] = safe.moved_m
        self._rates[:] = safe.rates_m_s

    def problem(self, dt_s: float) -> IkProblem:
        """Build the QP of the next step, without making it."""
        self._dt[0] = dt_s
        self._compiled.builder.function.evaluate()
        return self._compiled.builder.problem

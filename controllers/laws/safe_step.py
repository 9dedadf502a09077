"""The last word on every step: how fast, and never past a limit, exactly.

A wanted rate of the chambers becomes the next rates and lengths:

1. Length rate and pressure slew scale it down as a whole, so that the tip slows down instead of
   turning aside.
2. So does the acceleration, as far as it can: what was fast a tick ago cannot stand now.
3. **The place where the arm could stop is inside every limit, at every tick.** A step that breaks
   this is mixed with braking as hard as the acceleration allows, which never breaks it: lengths
   and bend are convex sets, braking goes along a straight line, and its end is inside. A keep-out
   and a coupled pressure map are no convex sets: they are looked at on the way as well.

So no limit is ever left, also not by an arm that is at full speed when the target changes.
"""

import casadi as ca
import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.geometry.compiled_function import CompiledFunction
from pneuarm.controllers.kinematics.compiled import TipState
from pneuarm.controllers.laws.solve_ik import IkProblem
from pneuarm.controllers.limits.limit import column
from pneuarm.controllers.limits.limits import Limits
from pneuarm.controllers.targets.targets import PARTS, ROWS
from pneuarm.controllers.tasks.rows import Parts, symbolic_rows
from pneuarm.controllers.tasks.wanted import symbols

#: What rounding may take from a slack, m.
_ROUNDING_M = 1e-14

#: Share of the acceleration that braking plans with.
_BRAKING_SHARE = 0.8

_HALVINGS = 5
_TINY = 1e-12


class SafeStep:
    """The compiled step. Arguments are arrays of the caller's, see :class:`solve_ik.IkBuilder`.

    ``task_rows`` is the number of rows of the problem's Jacobian.
    """

    def __init__(self, arm: Arm, limits: Limits, whole: bool, task_rows: int) -> None:
        self._arm, self._limits = arm, limits
        self._rate_max = column(arm.per_chamber("length_rate_max_m_s"))
        self._acceleration = column(arm.per_chamber("length_acceleration_max_m_s2"))
        n = arm.n_chambers
        lengths, rates, wish = (ca.SX.sym(name, n) for name in ("lengths", "rates", "wish"))
        vector, want = symbols(n, PARTS)
        dt, share = ca.SX.sym("dt"), ca.SX.sym("share")
        jacobian, checks = ca.SX.sym("jacobian", n, task_rows), ca.SX.sym("checks", 3)
        slowed = self._slowed(lengths, wish, dt, want, jacobian.T, checks[2])
        after = self._rates(rates, slowed, dt, share)
        moved = lengths + dt * after
        slacks = self._left(lengths, moved, after, dt, share)
        rows = symbolic_rows(arm, moved, want, ROWS, whole)
        self.function = CompiledFunction(
            "safe_step",
            [lengths, rates, vector, dt, wish, share, jacobian, checks],
            [moved, after, slacks, rows.error_m, rows.transform, rows.tip_jacobian],
        )
        self.wish, self._share = np.zeros(n), np.zeros(1)
        results = self.function.results
        self.moved_m, self.rates_m_s, self._slacks_m, self._error_m, transform, tip = results
        self.tip = TipState(transform[:3, 3], transform[:3, :3], tip)

    def bind(
        self, lengths_m: Array, rates_m_s: Array, wanted: Array, dt_s: Array, problem: IkProblem
    ) -> None:
        """Read the arguments from these arrays from now on."""
        state = [lengths_m, rates_m_s, wanted, dt_s, self.wish, self._share]
        self.function.bind([*state, problem.jacobian, problem.checks])
        self._rates_before = rates_m_s

    @property
    def error_m(self) -> float:
        """How far the tasks are from done, after the step."""
        return float(self._error_m[0])

    def _slowed(
        self,
        lengths: ca.SX,
        wish: ca.SX,
        dt: ca.SX,
        want: Parts,
        jacobian: ca.SX,
        by_feedback: ca.SX,
    ) -> ca.SX:
        """Rates that are wished (n,), m/s, slowed down as a whole to everything that is too fast.

        What feedback wants ends where the error does, and braking for it has to begin in time; a
        velocity that is asked for has no end.
        """
        wanted, largest = wish * self._rate_max, ca.mmax(self._rate_max)
        tip_speed = largest * by_feedback * ca.norm_2(jacobian @ wish)
        gain = ca.fmin(want["gain_per_s"], 1.0 / dt)
        distance = by_feedback * ca.fabs(wanted) / gain
        braking = _BRAKING_SHARE * self._acceleration
        # v dt + v^2 / (2 braking) = distance: one tick goes by before braking begins.
        braked = ca.mmin(2.0 / (dt + ca.sqrt(dt * dt + 2.0 * distance / braking)))
        most = ca.vertcat(
            1.0,
            ca.norm_inf(wish),
            *(limit.rate_share(lengths, wanted) for limit in self._limits),
            tip_speed / (want["speed_max_m_s"] + _TINY),
            gain / braked,
        )
        return wanted / ca.mmax(most)

    def _rates(self, rates: ca.SX, wanted: ca.SX, dt: ca.SX, share: ca.SX) -> ca.SX:
        """Rates after a tick: ``share`` of the way from braking to what is wanted (n,), m/s."""
        change = self._acceleration * dt
        # s wanted lies within the acceleration's box for s between low and high.
        size, along = ca.fmax(ca.fabs(wanted), _TINY), rates * ca.sign(wanted)
        low, high = ca.mmax((along - change) / size), ca.mmin((along + change) / size)
        projected = ca.dot(rates, wanted) / (ca.sumsqr(wanted) + _TINY**2)
        factor = ca.if_else(
            low <= high,
            ca.fmax(ca.fmin(high, 1.0), low),
            ca.fmin(ca.fmax(projected, 0.0), 1.0),
        )
        slowed = ca.fmin(ca.fmax(factor * wanted, rates - change), rates + change)
        slowed = ca.fmin(ca.fmax(slowed, -self._rate_max), self._rate_max)
        braked = self._braked(rates, dt)
        return braked + share * (slowed - braked)

    def _stopping_time(self, rates: ca.SX) -> ca.SX:
        return ca.mmax(ca.fabs(rates) / self._acceleration)

    def _braked(self, rates: ca.SX, dt: ca.SX) -> ca.SX:
        """All chambers slowed down by one share, the most that the acceleration allows."""
        return rates * ca.fmax(0.0, 1.0 - dt / (self._stopping_time(rates) + _TINY))

    def _left(self, before: ca.SX, moved: ca.SX, rates: ca.SX, dt: ca.SX, share: ca.SX) -> ca.SX:
        """What is left of every limit (k,), in metres; CasADi's own minimum would drop a NaN.

        What is no convex set is looked at in places, so braking needs room for what lies between:
        half of a margin, or what there is of it already. A chamber that is vented to the last
        pascal must not keep the others from moving.
        """
        stop = moved + rates * (0.5 * self._stopping_time(rates))
        places = [moved, 0.5 * (moved + stop), stop]
        slacks = [limit.step_slack(before, moved, dt) for limit in self._limits]
        for limit in self._limits:
            if limit.convex:
                slacks.append(limit.slack(stop))
                continue
            room = ca.fmax(0.0, ca.fmin(0.5 * limit.margin_m, limit.slack(before)))
            slacks += [limit.slack(place) - (share > 0.0) * room for place in places]
        return ca.vertcat(*slacks)

    def take(self, wish: Array | None) -> None:
        """Make the step nearest to a wish (n,), in units of the largest rates; None brakes.

        Afterwards ``moved_m`` and ``rates_m_s`` are the lengths and rates after the tick.
        """
        if wish is None:
            self.wish[:] = 0.0
            self._go_on(0.0, self._floor())
            return
        self.wish[:] = wish
        if not self._allowed(1.0, -_ROUNDING_M):
            self._mix(self._floor())

    def _allowed(self, share: float, floor: float) -> bool:
        self._share[0] = share
        self.function.evaluate()
        return bool((self._slacks_m >= floor).all())  # never true of a NaN

    def _floor(self) -> float:
        """What must be left: nothing, or where a limit is exceeded already, what is left now."""
        wish, rates = self.wish.copy(), self._rates_before.copy()
        self._stand()
        self.wish[:], self._rates_before[:] = wish, rates
        return min(0.0, float(self._slacks_m.min())) - _ROUNDING_M

    def _stand(self) -> None:
        self.wish[:], self._rates_before[:] = 0.0, 0.0
        self._allowed(0.0, 0.0)

    def _mix(self, floor: float) -> None:
        """Search the largest share of the wish, between it and braking, that is allowed."""
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._allowed(middle, floor) else (low, middle)
        self._go_on(low, floor)

    def _go_on(self, share: float, floor: float) -> None:
        """Take what was found; where not even braking is allowed, stand still at once."""
        if not self._allowed(share, floor):
            self._stand()

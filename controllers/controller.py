"""The controller: a target in, lengths and pressures out, once a tick."""

import numpy as np

from pneuarm.controllers.actuation.inverse_play import InversePlay
from pneuarm.controllers.actuation.pressure_map import PressureMap, length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.compiled import TipState
from pneuarm.controllers.laws.commanded_chambers import CommandedChambers, Law
from pneuarm.controllers.laws.settings import ControlSettings
from pneuarm.controllers.reach.detour import Detour
from pneuarm.controllers.reach.reach import Progress, Reach
from pneuarm.controllers.targets.chambers import LengthsTarget
from pneuarm.controllers.targets.same import same
from pneuarm.controllers.targets.target import LawName, Target

#: Lengths this near to the goal of the way round (m) are there.
AT_GOAL_M = 2e-5


class Controller:
    """Holds the commanded lengths and moves them toward the target, inside every limit."""

    def __init__(self, arm: Arm, settings: ControlSettings) -> None:
        self.settings = settings
        self.reach = Reach.NONE
        self.error_m = 0.0
        self.law_name = settings.default_law
        self._chambers = CommandedChambers(arm)
        self._limits = self._chambers.limits
        self._pressure_map = PressureMap(arm)
        self._inverse_play = InversePlay(arm)
        self._pressure_low = arm.per_chamber("pressure_min_pa")
        self._pressure_high = arm.per_chamber("pressure_max_pa")
        self._laws: dict[LawName, Law] = {
            LawName.RESOLVED_RATE: self._chambers.resolved_rate,
            LawName.QP_IK: self._chambers.qp_ik,
        }
        self._bounds_m = length_bounds_m(arm)
        self._detour = Detour(arm)
        self._progress = Progress(
            settings.reached_tolerance_m,
            settings.settled_time_s,
            settings.stalled_rate_m_s,
            settings.stalled_time_s,
        )
        # The way round is judged by the lengths: the tip may go away from its target first.
        self._way = Progress(AT_GOAL_M, 0.0, settings.stalled_rate_m_s, settings.stalled_time_s)
        self._target: Target | None = None
        self._judged: Target | None = None  # the first of those that ask for the same
        self._awaited = self._sends_pressures = False
        self._offset_m, self._turn = np.zeros(3), np.eye(3)
        # Of the vented arm as it hangs, until it is started from something.
        vented = self._pressure_map.lengths_m(np.zeros((arm.n_sections, 3)))
        self._chambers.place(self._limits.clip(vented))
        self.lengths_m = self._chambers.lengths_m

    @property
    def fallbacks(self) -> int:
        """How often the QP gave no usable result, and the damped law went on instead."""
        return self._chambers.qp_ik.fallbacks

    def warm_up(self) -> None:
        """Run every law once at the rest lengths, so that no tick pays for a first use."""
        for law in self._laws.values():
            law.wish(self._chambers.problem(1e-3))
        self.binding()

    def start_from(self, pressures_pa: Array) -> None:
        """Take the lengths of the given pressures (n_sections, 3), clipped, without a target."""
        if not self._inverse_play.none:
            pressures_pa = self._inverse_play.start_from(pressures_pa)
        self._chambers.place(self._limits.clip(self._pressure_map.lengths_m(pressures_pa)))
        self.lengths_m = self._chambers.lengths_m
        self.set_target(None)

    def set_correction(self, offset_m: Array, rotation: Array) -> None:
        """Say by how much the tip is elsewhere than the model has it, from now on.

        The laws then see the tip at ``p(q) + offset_m`` (3,), turned to ``rotation R(q)`` (3, 3).
        """
        self._offset_m, self._turn = offset_m, rotation
        self._chambers.correct(offset_m, rotation)

    def set_hysteresis_share(self, share: float) -> None:
        """Invert so much of the calibrated hysteresis, 0 to 1, from now on."""
        self._inverse_play.share = share

    @property
    def model_tip(self) -> TipState:
        """Tip of the commanded lengths by the model alone; reused by the next step."""
        return self._chambers.tip

    def tip(self) -> TipState:
        """Tip of the commanded lengths with the correction, in the base frame."""
        model = self._chambers.tip
        return TipState(
            model.position_m + self._offset_m, self._turn @ model.rotation, model.jacobian
        )

    def set_target(
        self, target: Target | None, moving: bool = False, awaited: bool = False
    ) -> None:
        """Follow a new target from where the command stands now; None brakes and holds.

        A target that is only on the way, ``moving``, is never reached nor out of reach. While the
        arm itself is still ``awaited`` there, the target is not reached by the command alone.
        """
        if moving or target is None or not same(target, self._judged):
            self._progress.start()
            self._judged = target
        self._target, self._awaited = target, awaited
        self._detour.set_target(target, self._offset_m)
        if target is None:
            self.reach, self.error_m = Reach.NONE, 0.0
            return
        settings = self.settings
        asked = target.in_lengths(self._lengths_of)
        self._chambers.ask(asked, settings.gain_per_s, settings.tip_speed_max_m_s)
        self._sends_pressures = target.sends_pressures
        self.law_name = self._law_name(target)
        if self._detour.taken and self._detour.goal_m is not None:
            self._chambers.pursue(LengthsTarget(self._detour.goal_m))

    def _law_name(self, target: Target) -> LawName:
        if target.law != LawName.DEFAULT:
            return target.law
        return target.default_law or self.settings.default_law

    def _lengths_of(self, pressures_pa: Array) -> Array:
        """Lengths (n_sections, 3) that pressures give, within their bounds."""
        return np.clip(self._pressure_map.lengths_m(pressures_pa), *self._bounds_m)

    def step(self, dt_s: float) -> TipState:
        """Move the commanded lengths by one tick; return the tip they stand for, corrected.

        A duration that is no positive number moves nothing.
        """
        if not 0.0 < dt_s < np.inf:
            return self.tip()
        law = None if self._target is None else self._laws[self.law_name]
        self._chambers.step(law, dt_s)
        self.lengths_m = self._chambers.lengths_m
        if self._target is not None:
            self._judge(self._chambers.error_m, dt_s)
        return self.tip()

    def _judge(self, error_m: float, dt_s: float) -> None:
        """Say whether the target is reached, being reached, or out of reach; or go round."""
        if self._target is not None and not self._target.has_end:
            self.reach = Reach.MOVING
            return
        self.error_m = error_m
        if self._is_going_round(dt_s):
            self.reach = Reach.MOVING
            self._progress.start()
            return
        self.reach = self._progress.judge(error_m, dt_s)
        if self._awaited and self.reach == Reach.REACHED:
            self.reach = Reach.MOVING
        stalled = self.reach == Reach.OUT_OF_REACH
        if self._detour.begins(error_m, dt_s, stalled) and self._detour.goal_m is not None:
            self._chambers.pursue(LengthsTarget(self._detour.goal_m))
            self.reach = Reach.MOVING
            self._progress.start()
            self._way.start()

    def _is_going_round(self, dt_s: float) -> bool:
        """Whether the way round is taken, and its goal comes nearer still."""
        goal = self._detour.goal_m
        if not self._detour.taken or goal is None:
            return False
        left_m = max(map(abs, (goal - self.lengths_m).reshape(-1).tolist()))
        return self._way.judge(max(0.0, left_m - self._detour.slack_m), dt_s) == Reach.MOVING

    def pressures_pa(self) -> Array:
        """Gauge pressures (n_sections, 3) of the commanded lengths, inside their limits.

        The way through lengths and back rounds, and a bound must not be exceeded by one bit.
        """
        pressures = self._pressure_map.pressures_pa(self.lengths_m)
        if not self._inverse_play.none:
            pressures = self._inverse_play.sent_pa(pressures, self._sends_pressures)
        return np.minimum(np.maximum(pressures, self._pressure_low), self._pressure_high)

    def binding(self) -> int:
        """Return the bits of the limits that the commanded lengths are at."""
        return self._limits.binding(self.lengths_m)

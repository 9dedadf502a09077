"""The controller: a target in, lengths and pressures out, once a tick."""

from enum import IntEnum, IntFlag

import numpy as np

from controllers.actuation import PressureMap, pressure_length_bounds_m
from controllers.arm import LENGTH_MARGIN_M, Arm, Array
from controllers.errors import InvalidInput
from controllers.inverse_play import InversePlay
from controllers.kinematics.compiled import CompiledKinematics, TipState
from controllers.law import AT_BOUND_M, Law, Limits
from controllers.qp_ik import QpIk
from controllers.resolved_rate import ResolvedRate
from controllers.settings import ControlSettings
from controllers.targets import (
    LawName,
    LengthsTarget,
    PoseTarget,
    PositionTarget,
    PressuresTarget,
    ShapeTarget,
    Target,
    TwistTarget,
)
from controllers.tasks.chamber_lengths import ChamberLengths
from controllers.tasks.task import Task
from controllers.tasks.tip_pose import TipPose, rotation_from_quaternion
from controllers.tasks.tip_position import TipPosition
from controllers.tasks.tip_twist import TipTwist


class Reach(IntEnum):
    """How the commanded arm stands to its target, numbered as on the wire."""

    NONE = 0
    MOVING = 1
    REACHED = 2
    OUT_OF_REACH = 3


class Binding(IntFlag):
    """Which limits stop the commanded arm, as bits on the wire."""

    NOTHING = 0
    LENGTH = 1
    BEND = 2
    PRESSURE = 4


class Controller:
    """Holds the commanded lengths and moves them toward the target, inside every limit."""

    def __init__(self, arm: Arm, settings: ControlSettings) -> None:
        self.settings = settings
        self._pressure_map = PressureMap(arm)
        self._inverse_play = InversePlay(arm)
        #: Of the vented arm as it hangs, until it is started from something.
        self.lengths_m = self._pressure_map.lengths_m(np.zeros((arm.n_sections, 3)))
        self.fallbacks = 0
        self.reach = Reach.NONE
        self.error_m = 0.0
        self._limits = Limits(arm)
        self._kinematics = CompiledKinematics(arm)
        self._offset_m, self._turn = np.zeros(3), np.eye(3)
        self._model_tip = self._kinematics.evaluate(self.lengths_m)
        self._laws: dict[LawName, Law] = {
            LawName.RESOLVED_RATE: ResolvedRate(self._limits),
            LawName.QP_IK: QpIk(arm, self._limits),
        }
        low, high = pressure_length_bounds_m(arm)
        self._pressure_is_tighter = (
            low > arm.per_chamber("length_min_m") + LENGTH_MARGIN_M,
            high < arm.per_chamber("length_max_m") - LENGTH_MARGIN_M,
        )
        self._pressure_low = arm.per_chamber("pressure_min_pa")
        self._pressure_high = arm.per_chamber("pressure_max_pa")
        self._task: Task | None = None
        self._sends_pressures = False
        self._law = self._laws[settings.default_law]
        self.law_name = settings.default_law
        self._near_s = self._stalled_s = 0.0
        self._moving = False

    def warm_up(self) -> None:
        """Run every law once at the rest lengths, so that no tick pays for a first use."""
        tip = self._kinematics.evaluate(self.lengths_m)
        task = TipPosition(tip.position_m.copy(), self.settings.gain_per_s, 1.0)
        for law in self._laws.values():
            law.step(task, tip, self.lengths_m, 1e-3)

    def start_from(self, pressures_pa: Array) -> None:
        """Take the lengths of the given pressures (n_sections, 3), clipped, without a target."""
        if not self._inverse_play.none:
            pressures_pa = self._inverse_play.start_from(pressures_pa)
        self.lengths_m = self._limits.clip(self._pressure_map.lengths_m(pressures_pa))
        self._model_tip = self._kinematics.evaluate(self.lengths_m)
        self.set_target(None)

    def set_target(self, target: Target | None, moving: bool = False) -> None:
        """Follow a new target from where the command stands now; None holds.

        A target that is only on the way, ``moving``, is never reached.
        """
        self._moving = moving
        self._task = None if target is None else self._task_of(target)
        if target is None:
            self.reach, self.error_m = Reach.NONE, 0.0
            self._near_s = self._stalled_s = 0.0
            return
        self._sends_pressures = isinstance(target, PressuresTarget)
        self.law_name = self._law_name(target)
        self._law = self._laws[self.law_name]

    def _law_name(self, target: Target) -> LawName:
        if target.law != LawName.DEFAULT:
            return target.law
        if isinstance(target, TwistTarget):
            return LawName.RESOLVED_RATE
        return self.settings.default_law

    def _task_of(self, target: Target) -> Task:
        gain, speed = self.settings.gain_per_s, self.settings.tip_speed_max_m_s
        match target:
            case PositionTarget():
                return TipPosition(target.position_m, gain, speed, target.velocity_m_s)
            case PoseTarget():
                rotation = rotation_from_quaternion(target.quaternion_xyzw)
                return TipPose(target.position_m, rotation, gain, speed)
            case TwistTarget():
                return TipTwist(
                    target.linear_m_s,
                    target.angular_rad_s,
                    target.in_tip_frame,
                    target.about_base_origin,
                )
            case LengthsTarget():
                return ChamberLengths(target.lengths_m, gain)
            case PressuresTarget():
                lengths = self._pressure_map.lengths_m(target.pressures_pa)
                return ChamberLengths(self._limits.length.clip(lengths), gain)
            case ShapeTarget():
                raise InvalidInput("a shape comes to the law as the positions along it")

    def set_correction(self, offset_m: Array, rotation: Array) -> None:
        """Say by how much the tip is elsewhere than the model has it, from now on.

        The laws then see the tip at ``p(q) + offset_m`` (3,), turned to ``rotation R(q)`` (3, 3).
        """
        self._offset_m, self._turn = offset_m, rotation

    def set_hysteresis_share(self, share: float) -> None:
        """Invert so much of the calibrated hysteresis, 0 to 1, from now on."""
        self._inverse_play.share = share

    @property
    def model_tip(self) -> TipState:
        """Tip of the commanded lengths by the model alone, without the correction."""
        return self._model_tip

    def tip(self) -> TipState:
        """Tip of the commanded lengths with the correction, in the base frame."""
        model = self._model_tip
        return TipState(
            model.position_m + self._offset_m, self._turn @ model.rotation, model.jacobian
        )

    def step(self, dt_s: float) -> TipState:
        """Move the commanded lengths by one tick; return the tip they stand for, corrected."""
        if self._task is None:
            return self.tip()
        step = self._law.step(self._task, self.tip(), self.lengths_m, dt_s)
        self.fallbacks += step.fell_back
        moved = max(map(abs, (step.lengths_m - self.lengths_m).reshape(-1).tolist()))
        self.lengths_m = step.lengths_m
        self._model_tip = self._kinematics.evaluate(self.lengths_m)
        tip = self.tip()
        self._judge(tip, moved, dt_s)
        return tip

    def pressures_pa(self) -> Array:
        """Gauge pressures (n_sections, 3) of the commanded lengths, inside their limits.

        The way through lengths and back rounds, and a bound must not be exceeded by one bit.
        """
        pressures = self._pressure_map.pressures_pa(self.lengths_m)
        if not self._inverse_play.none:
            pressures = self._inverse_play.sent_pa(pressures, self._sends_pressures)
        return np.minimum(np.maximum(pressures, self._pressure_low), self._pressure_high)

    def _judge(self, tip: TipState, moved_m: float, dt_s: float) -> None:
        """Say whether the target is reached, being reached, or out of reach."""
        if self._task is None:
            return
        self.error_m = self._task.error_m(tip, self.lengths_m)
        if isinstance(self._task, TipTwist):
            self.reach = Reach.MOVING
            return
        near = self.error_m <= self.settings.reached_tolerance_m
        still = moved_m < self.settings.stalled_rate_m_s * dt_s
        # The air follows the command with a lag: reached is what has been there for a while.
        self._near_s = self._near_s + dt_s if near and not self._moving else 0.0
        self._stalled_s = self._stalled_s + dt_s if still and not near else 0.0
        if self._near_s >= self.settings.settled_time_s:
            self.reach = Reach.REACHED
        elif self._stalled_s >= self.settings.stalled_time_s:
            self.reach = Reach.OUT_OF_REACH
        else:
            self.reach = Reach.MOVING

    def binding(self) -> Binding:
        """Return the limits that the commanded lengths touch."""
        binding = Binding.NOTHING
        low = self.lengths_m - self._limits.length.lower_m < AT_BOUND_M
        high = self._limits.length.upper_m - self.lengths_m < AT_BOUND_M
        by_pressure = (low & self._pressure_is_tighter[0]) | (high & self._pressure_is_tighter[1])
        if by_pressure.any():
            binding |= Binding.PRESSURE
        if ((low | high) & ~by_pressure).any():
            binding |= Binding.LENGTH
        if (self._limits.bend.slack_m(self.lengths_m) < AT_BOUND_M).any():
            binding |= Binding.BEND
        return binding

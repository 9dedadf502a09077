"""Everything between a target and the setpoints of a tick: reference, correction, law, estimate.

What is to be told is returned as a :class:`Notice`; whoever calls tells it.
"""

import math
from dataclasses import replace

import numpy as np

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.actuation.valve_lead import ValveLead
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.controller import Controller
from pneuarm.controllers.feedback.estimator import Estimator
from pneuarm.controllers.feedback.notch import Notch
from pneuarm.controllers.feedback.observer import FeedbackSettings, TipObserver, Verdict
from pneuarm.controllers.geometry.moving_point import MovingPoint
from pneuarm.controllers.geometry.rotations import rotation_from_quaternion
from pneuarm.controllers.laws.settings import ControlSettings
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.reference.follower import Follower, lead_of
from pneuarm.controllers.reference.trajectory import ReferenceLimits
from pneuarm.controllers.targets.same import same
from pneuarm.controllers.targets.targets import ShapeTarget, Target
from pneuarm.hardware.interface import Measurement
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.control.record import Estimate, Steered
from pneuarm.service.control.setpoints import Setpoints
from pneuarm.service.modes.mode_keeper import Notice
from pneuarm.service.processes.pipe import SetTarget, SetTipPose

#: What may happen in every tick is told this often at most.
_TELL_EVERY_S = 10.0

_STANDS = MovingPoint([0.0] * 3, [0.0] * 3, [0.0] * 3)


class Steering:
    """One arm's reference, observer, controller and setpoints."""

    def __init__(
        self,
        arm: Arm,
        control: ControlSettings,
        reference: ReferenceLimits,
        feedback: FeedbackSettings,
        period_s: float,
    ) -> None:
        self._controller, self._feedback = Controller(arm, control), feedback
        valves = ValveLead(arm.response)
        quick = replace(arm, response=valves.behind)
        gain_per_s = control.gain_per_s
        self._follower = Follower(arm, reference, lead_of(quick.response), gain_per_s, period_s)
        # What goes to and fro around a reached place, within what counts as reached, stands.
        still_m = 2.0 * control.reached_tolerance_m
        self._observer = TipObserver(quick, feedback, period_s, still_m)
        self._notch = Notch(arm.response)
        self._estimator = Estimator(arm)
        self._setpoints = Setpoints(arm, feedback, valves)
        self._vented_m = PressureMap(arm).lengths_m(np.zeros((arm.n_sections, 3)))
        self._observer.prediction.restart(self._vented_m)
        self.tip_m = self._tip_before_m = np.zeros(3)
        self._target: Target | None = None
        self._same_again = False
        self._camera_seen = self._near_reference = self._limited = self._too_fast = False
        self._verdict = Verdict.TAKEN
        self._told_error = ""
        self._told_fallbacks, self._tell_again_s = 0, 0.0
        self._dt_s = period_s

    @property
    def held_pa(self) -> Array:
        """Pressures (n_sections, 3) that a hold keeps."""
        return self._setpoints.held_pa

    def warm_up(self) -> None:
        """Run once what a tick may run later for the first time."""
        self._controller.warm_up()
        self._controller.binding()

    def set_target(self, command: SetTarget) -> Notice | None:
        """Take a target; the reference goes on from where it is."""
        target, controller = command.target, self._controller
        velocity = (self.tip_m - self._tip_before_m) / self._dt_s
        self._follower.set_target(target, command.received_ns * 1e-9, controller.tip(), velocity)
        self._same_again = target.has_end and same(target, self._target)
        self._target = target
        if not self._follower.follows:
            controller.set_target(target)
        told, self._told_error = self._told_error, self._follower.error
        if self._told_error not in ("", told):
            return Notice(
                pb.WARNING,
                "reference_error",
                "the new target was not taken; the reference goes on to the one before",
                self._told_error,
                "send another target",
            )
        return self._too_fast_notice()

    def _too_fast_notice(self) -> Notice | None:
        """Tell when a target begins to be faster than the reference may be."""
        before, fast_m_s = self._too_fast, self._follower.too_fast_m_s
        self._too_fast = fast_m_s > 0.0
        if before or not self._too_fast:
            return None
        return Notice(
            pb.WARNING,
            "target_too_fast",
            f"the target moves at {1e3 * fast_m_s:.0f} mm/s, faster than the reference may along "
            "an axis: it is followed at the reference's speed, and falls behind",
            "velocity_m_s of the target",
            "send slower targets, or raise reference.speed_max_mm_s",
        )

    def stop(self) -> None:
        """Follow nothing any more."""
        self._follower.forget()
        self._target, self._same_again = None, False
        self._controller.set_target(None)

    def start(self, measured_pa: Array | None) -> None:
        """Take the commanded lengths from measured pressures, without a target.

        None goes on from the pressures that are held.
        """
        self._setpoints.start(measured_pa)
        if measured_pa is not None:
            self._observer.forget_swings()
        self._controller.set_hysteresis_share(self._setpoints.hysteresis_share)
        self._controller.start_from(self.held_pa)
        self._follower.forget()
        self._target, self._same_again = None, False
        self._notch.restart(self._observer.offset_m)
        self._controller.set_correction(self._observer.offset_m, self._observer.rotation)
        self.tip_m = self._tip_before_m = self._controller.tip().position_m

    def measure(self, pose: SetTipPose, now_ns: int) -> Notice | None:
        """Take a measured tip pose, or say once why not."""
        rotation = rotation_from_quaternion(pose.quaternion_xyzw)
        waited_s = (now_ns - pose.received_ns) * 1e-9
        verdict = self._observer.measure(pose.position_m, rotation, waited_s, self._wanted_tip)
        before, self._verdict = self._verdict, verdict
        if verdict is Verdict.SWINGS:
            return self._swings_notice()
        if verdict is not before and verdict in (
            Verdict.REFUSED,
            Verdict.NOT_ALONG,
            Verdict.LATE,
        ):
            return self._disbelieved(verdict, waited_s)
        if verdict is Verdict.ACCEPTED_ANEW:
            return Notice(pb.INFO, "tip_pose_accepted", "the tip poses after the jump are taken")
        return None

    @property
    def _wanted_tip(self) -> MovingPoint | None:
        """Where the tip is to be, or any point where it is to stand; None where that is not known.

        Targets without a reference have it stand once they have been sent again.
        """
        if self._follower.follows:
            return self._follower.motion
        return _STANDS if self._same_again else None

    def _swings_notice(self) -> Notice:
        """Say that the correction is turned down, how far and for how long."""
        slow_s, swing = self._observer.time_constant_s, self._observer.swing
        now = "stays as it is" if math.isinf(slow_s) else f"follows in {slow_s:.1f} s only"
        return Notice(
            pb.WARNING,
            "correction_swings",
            f"the tip swings by {1e3 * swing.way_m:.1f} mm every {swing.period_s:.1f} s around "
            f"where it is to be: its correction {now}, until the arm is armed anew from idle",
            "valves, camera or body answer otherwise than [arm.response] and "
            "feedback.camera_delay_ms say, or something else moves the arm",
            "measure the response with `pneuarm calibrate`, and the camera's delay",
        )

    def _disbelieved(self, verdict: Verdict, waited_s: float) -> Notice:
        """Say why measured poses are not taken."""
        feedback, most_mm = self._feedback, 1e3 * self._observer.offset_max_m
        if verdict is Verdict.NOT_ALONG:
            return Notice(
                pb.WARNING,
                "tip_pose_not_along",
                "measured tip poses are not believed, and the correction goes back to before: the "
                f"arm was told to move by {1e3 * feedback.still_max_m:g} mm and they did not go "
                "along",
                "a frozen camera or marker, exchanged axes, or something holds the arm",
                "look at the arm and the motion-capture program; feedback.still_max_mm allows more",
            )
        if verdict is Verdict.LATE:
            return Notice(
                pb.WARNING,
                "tip_pose_late",
                f"measured tip poses are refused: they are {1e3 * waited_s:.0f} ms old (allowed: "
                f"{1e3 * feedback.timeout_s:g} ms)",
                "the gateway or the machine stalled",
                "end what keeps the machine busy; feedback.camera_timeout_ms allows more",
            )
        return Notice(
            pb.WARNING,
            "tip_pose_refused",
            "measured tip poses are refused: they jumped by more than "
            f"{1e3 * feedback.jump_max_m:g} mm",
            "a wrong or exchanged marker, or the arm was moved",
            f"if they stay there for {feedback.jump_accept_s:g} s, no further than {most_mm:g} mm "
            "from the model, they are taken",
        )

    def step(self, dt_s: float, now_s: float) -> Array:
        """One tick of an active arm; returns the setpoints (n_sections, 3), gauge pressures."""
        self._dt_s = dt_s or self._dt_s
        self._tip_before_m = self.tip_m
        offset_m = self._notch.step(self._observer.offset_m, dt_s)
        self._controller.set_correction(offset_m, self._observer.rotation)
        wanted = None
        if dt_s > 0.0:
            wanted = self._follower.step(dt_s, self._controller.lengths_m)
        if wanted is not None:
            awaited = self._corrected and not self._near_reference
            self._controller.set_target(wanted, not self._follower.arrived, awaited)
        self.tip_m = self._controller.step(dt_s).position_m
        setpoints_pa = self._setpoints.step(
            self._controller.pressures_pa(),
            dt_s,
            now_s,
            self._target is not None and self._target.sends_pressures,
            self._follower.motion,
            self._corrected,
        )
        self._controller.set_hysteresis_share(self._setpoints.hysteresis_share)
        return setpoints_pa

    @property
    def _corrected(self) -> bool:
        return self._observer.seen and self._feedback.enabled

    def fallback_notice(self, now_s: float) -> Notice | None:
        """Tell that the QP gave nothing and the damped law went on, once in a while."""
        count = self._controller.fallbacks
        if count <= self._told_fallbacks or now_s < self._tell_again_s:
            return None
        self._told_fallbacks, self._tell_again_s = count, now_s + _TELL_EVERY_S
        return Notice(
            pb.WARNING,
            "qp_fallback",
            f"the QP gave no usable step, the damped law went on instead; {count} times so far",
        )

    def observe(self, vented: bool) -> Notice | None:
        """Let the observer see this tick's command; tell of lost cameras and held corrections."""
        self._observer.step(self._vented_m if vented else self._controller.lengths_m)
        if self._observer.limited != self._limited:
            self._limited = self._observer.limited
            if self._limited:
                return self._limited_notice()
        if self._observer.seen == self._camera_seen:
            return None
        self._camera_seen = self._observer.seen
        if self._camera_seen:
            return Notice(pb.INFO, "camera_seen", "measured tip poses arrive")
        return Notice(
            pb.WARNING,
            "camera_lost",
            "no measured tip pose arrives; the correction stays as it is",
            f"none was taken for {1e3 * self._feedback.timeout_s:g} ms",
            "look at the marker and the motion-capture program; one that is slower needs a longer "
            "feedback.camera_timeout_ms",
        )

    def _limited_notice(self) -> Notice:
        most_mm, turn_deg = (
            1e3 * self._observer.offset_max_m,
            math.degrees(self._feedback.turn_max_rad),
        )
        return Notice(
            pb.WARNING,
            "correction_limited",
            f"the measured tip is more than {most_mm:g} mm or {turn_deg:g} degrees from the "
            "model's; the correction is held there",
            "a drifting or wrong sensor, a wrong frame, a heavy load",
            "compare the arm with what is measured; feedback.offset_max_share and turn_max_deg "
            "allow more",
        )

    def estimate(self, measurement: Measurement) -> Estimate:
        """Lengths and tip from what was measured; call it after :meth:`observe`."""
        lengths_m = self._estimator.lengths_m(measurement.pressures_pa, measurement.lengths_m)
        tip = self._estimator.tip_estimate(lengths_m, measurement.lengths_m, self._observer)
        reference = self._follower.motion
        if reference is None:
            return Estimate(lengths_m, tip, 0.0)
        error_m = math.dist(tip.position_m.tolist(), reference.position[:3])
        self._near_reference = error_m <= self._controller.settings.reached_tolerance_m
        return Estimate(lengths_m, tip, error_m)

    def steered(self) -> Steered:
        """How the commanded arm stands after this tick."""
        controller, observer = self._controller, self._observer
        stuck = controller.reach == Reach.OUT_OF_REACH
        goal_m, goal_quaternion_xyzw = self._goal()
        return Steered(
            lengths_m=controller.lengths_m,
            law=controller.law_name,
            reach=controller.reach,
            error_m=controller.error_m,
            binding=controller.binding() if stuck else 0,
            qp_fallbacks=controller.fallbacks,
            goal_m=goal_m,
            goal_quaternion_xyzw=goal_quaternion_xyzw,
            reference=self._follower.motion,
            tip_model_m=observer.prediction.ago(0.0)[0],
            tip_offset_m=observer.offset_m,
            tip_offset_quaternion_xyzw=observer.quaternion_xyzw,
            tip_poses_refused=observer.refused,
        )

    def _goal(self) -> tuple[Array | list[float] | None, Array | None]:
        """Position (3,) that is wanted now, a shape's on the shape, and quaternion; or None."""
        target = self._target
        if isinstance(target, ShapeTarget):
            return self._follower.goal_position, None
        return (None, None) if target is None else target.goal()

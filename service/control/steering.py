"""Everything between a target and the pressures of a tick: reference, correction, law, dither."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from pneuarm.controllers.actuation.dither import Dither
from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.actuation.valve_lead import ValveLead
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.controller import Controller
from pneuarm.controllers.feedback.estimator import TipEstimate
from pneuarm.controllers.feedback.notch import Notch
from pneuarm.controllers.feedback.observer import FeedbackSettings, TipObserver, Verdict
from pneuarm.controllers.geometry.rotations import (
    quaternion_from_rotation,
    rotation_from_quaternion,
)
from pneuarm.controllers.reference.follower import Follower, lead_of
from pneuarm.controllers.reference.trajectory import ReferenceLimits
from pneuarm.controllers.targets.targets import ShapeTarget, Target
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.processes.pipe import SetTarget, SetTipPose

Tell = Callable[["pb.Level", str, str, str, str], None]

_NONE = np.full(3, np.nan)

#: The dither grows from nothing, and a share of the hysteresis or the lead from 0 to 1, in this
#: time (s).
_RAMP_S = 0.3

#: A reference as fast as this (m/s) moves the arm through its hysteresis by itself.
_MOVING_M_S = 0.06


class Steering:
    """One arm's reference, observer and controller.

    ``tell`` takes level, code, text, cause and remedy of an event.
    """

    def __init__(
        self,
        arm: Arm,
        controller: Controller,
        reference: ReferenceLimits,
        feedback: FeedbackSettings,
        period_s: float,
        tell: Tell,
    ) -> None:
        self._controller, self._feedback, self._tell = controller, feedback, tell
        gain = controller.settings.gain_per_s
        self._valves = ValveLead(arm.response.lag_s)
        quick = replace(arm, response=replace(arm.response, lag_s=self._valves.remaining_s))
        self._follower = Follower(reference, lead_of(quick.response), gain, period_s)
        self.observer = TipObserver(quick, feedback, period_s)
        self._notch = Notch(arm.response)
        self._dither = Dither(feedback.dither_pa, feedback.dither_period_s)
        self._vented_m = PressureMap(arm).lengths_m(np.zeros((arm.n_sections, 3)))
        self.tip_m = self._tip_before_m = np.zeros(3)
        self._target: Target | None = None
        self._seen = self._refusing = False
        self._told_error = ""
        self._near = False
        self._share = self._lead_share = 1.0
        self._dither_since_s: float | None = None
        self._dt_s = period_s

    def set_target(self, command: SetTarget) -> None:
        """Take a target; the reference goes on from where it is."""
        target, controller = command.target, self._controller
        velocity = (self.tip_m - self._tip_before_m) / self._dt_s
        self._follower.set_target(target, command.received_ns * 1e-9, controller.tip(), velocity)
        self._target = target
        if not self._follower.follows:
            controller.set_target(target)
        if self._follower.error and self._follower.error != self._told_error:
            self._tell(
                pb.WARNING,
                "reference_error",
                "the new target was not taken; the reference goes on to the one before",
                self._follower.error,
                "send another target",
            )
        self._told_error = self._follower.error

    def stop(self) -> None:
        """Follow nothing any more."""
        self._follower.forget()
        self._target = None
        self._controller.set_target(None)

    def start_from(self, pressures_pa: Array) -> None:
        """Take the commanded lengths from pressures, without a target.

        The whole hysteresis is inverted from here on: a share that went up only afterwards would
        move an arm to which nobody has said anything yet.
        """
        self._share = 1.0
        self._controller.set_hysteresis_share(1.0)
        self._controller.start_from(pressures_pa)
        self._follower.forget()
        self._valves.forget()
        self._target = None
        self._notch.restart(self.observer.offset_m)
        self._controller.set_correction(self.observer.offset_m, self.observer.rotation)
        self.tip_m = self._tip_before_m = self._controller.tip().position_m

    def measure(self, pose: SetTipPose, now_ns: int) -> None:
        """Take a measured tip pose, or say once why not."""
        rotation = rotation_from_quaternion(pose.quaternion_xyzw)
        waited_s = (now_ns - pose.received_ns) * 1e-9
        verdict = self.observer.measure(pose.position_m, rotation, waited_s)
        if verdict is Verdict.REFUSED and not self._refusing:
            self._tell(
                pb.WARNING,
                "tip_pose_refused",
                "measured tip poses are refused: they jumped by more than "
                f"{1e3 * self._feedback.jump_max_m:g} mm",
                "a wrong or exchanged marker, or the arm was moved",
                f"if they stay there for {self._feedback.jump_accept_s:g} s they are taken",
            )
        elif verdict is Verdict.ACCEPTED_ANEW:
            self._tell(
                pb.INFO, "tip_pose_accepted", "the tip poses after the jump are taken", "", ""
            )
        self._refusing = verdict is Verdict.REFUSED

    def step(self, dt_s: float) -> Array:
        """One tick of an active arm; returns gauge pressures (n_sections, 3) without the dither."""
        self._dt_s = dt_s or self._dt_s
        self._tip_before_m = self.tip_m
        offset_m = self._notch.step(self.observer.offset_m, dt_s)
        self._controller.set_correction(offset_m, self.observer.rotation)
        wanted = self._follower.step(dt_s) if dt_s > 0.0 else None
        if wanted is not None:
            awaited = self.observer.seen and self._feedback.enabled and not self._near
            self._controller.set_target(wanted, not self._follower.arrived, awaited)
        self.tip_m = self._controller.step(dt_s).position_m
        return self._controller.pressures_pa()

    def sent_pa(self, wanted_pa: Array, dt_s: float, now_s: float) -> Array:
        """Setpoints for the valves, ahead of the wanted pressures, with the dither.

        Pressures that are asked for are sent as they are: a lead that overshoots in the end would
        cross the play that a calibration wants to see.
        """
        asks_pressures = self._target is not None and self._target.sends_pressures
        wanted = 0.0 if asks_pressures else 1.0
        largest = dt_s / _RAMP_S
        self._lead_share += min(max(wanted - self._lead_share, -largest), largest)
        return self._valves.sent_pa(wanted_pa, dt_s, self._lead_share) + self._dither_pa(now_s)

    def _dither_pa(self, now_s: float) -> float:
        """What is added to every setpoint.

        Only a reference that is followed with the tip measured needs it; a camera lost on the way
        changes nothing.
        """
        if not self._follower.follows:
            self._dither_since_s = None
            self._go_to_share(1.0)
            return 0.0
        if self._dither_since_s is None:
            if not (self.observer.seen and self._feedback.enabled):
                return 0.0
            self._dither_since_s = now_s
        share = min(1.0, (now_s - self._dither_since_s) / _RAMP_S)
        self._follow_share()
        return share * self._dither.at_pa(now_s)

    def _follow_share(self) -> None:
        """Let the inverted share of the hysteresis follow the speed of the reference."""
        motion, feedback = self._follower.motion, self._feedback
        speed_m_s = 0.0 if motion is None else math.hypot(*motion.velocity[:3])
        at_rest, moving = feedback.hysteresis_share, feedback.hysteresis_share_moving
        self._go_to_share(at_rest + min(1.0, speed_m_s / _MOVING_M_S) * (moving - at_rest))

    def _go_to_share(self, wanted: float) -> None:
        largest = self._dt_s / _RAMP_S
        self._share += min(max(wanted - self._share, -largest), largest)
        self._controller.set_hysteresis_share(self._share)

    def observe(self, vented: bool) -> None:
        """Let the observer see this tick's command; tell when the camera is lost or back."""
        self.observer.step(self._vented_m if vented else self._controller.lengths_m)
        if self.observer.seen == self._seen:
            return
        self._seen = self.observer.seen
        if self._seen:
            self._tell(pb.INFO, "camera_seen", "measured tip poses arrive", "", "")
        else:
            self._tell(
                pb.WARNING,
                "camera_lost",
                "no measured tip pose arrives; the correction stays as it is",
                f"none was taken for {1e3 * self._feedback.timeout_s:g} ms",
                "look at the marker and the motion-capture program",
            )

    def fill(self, tick: np.ndarray, estimate: TipEstimate) -> None:
        """Write down reference, model, correction and estimate."""
        observer = self.observer
        tick["tip_model_position_m"] = observer.prediction.ago(0.0)[0]
        tick["tip_offset_m"] = observer.offset_m
        tick["tip_offset_orientation_xyzw"] = observer.quaternion_xyzw
        tick["tip_estimated_position_m"] = estimate.position_m
        tick["tip_estimated_orientation_xyzw"] = quaternion_from_rotation(estimate.rotation)
        tick["tip_estimated_sigma_m"] = estimate.sigma_m
        tick["tip_estimated_source"] = int(estimate.source)
        tick["tip_poses_refused"] = observer.refused
        motion = self._follower.motion
        if motion is None:
            tick["reference_position_m"] = tick["reference_velocity_m_s"] = _NONE
            tick["reference_error_m"] = 0.0
            return
        tick["reference_position_m"] = motion.position[:3]
        tick["reference_velocity_m_s"] = motion.velocity[:3]
        error_m = math.dist(estimate.position_m.tolist(), motion.position[:3])
        tick["reference_error_m"] = error_m
        self._near = error_m <= self._controller.settings.reached_tolerance_m

    def goal(self) -> tuple[Array | list[float], Array | None]:
        """Position (3,) that is wanted now, a shape's on the shape, and quaternion or None."""
        target = self._target
        if isinstance(target, ShapeTarget):
            return self._follower.goal_position, None
        position, quaternion = (None, None) if target is None else target.goal()
        return _NONE if position is None else position, quaternion

"""One tick: read -> estimate -> control -> guard -> write -> record.

The time is an argument: the same loop runs on the clock, and in simulated time in the tests.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.feedback.estimator import Estimator
from pneuarm.controllers.feedback.observer import FeedbackSettings
from pneuarm.controllers.laws.controller import Controller, Reach
from pneuarm.controllers.laws.settings import ControlSettings
from pneuarm.controllers.reference.trajectory import ReferenceLimits
from pneuarm.controllers.targets.targets import KIND_OF, TargetKind
from pneuarm.controllers.tasks.tip_pose import quaternion_from_rotation
from pneuarm.hardware.guard import Guard, Intervention
from pneuarm.hardware.guarded import GuardedDevice, GuardedHardware
from pneuarm.hardware.interface import Hardware, Measurement
from pneuarm.logs.rings.status import Disk
from pneuarm.logs.rings.tick import new_tick
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.configuration.monitor_settings import MonitorSettings
from pneuarm.service.control.steering import Steering
from pneuarm.service.modes.mode import VENTED_MODES, Mode, ModeEvent
from pneuarm.service.modes.mode_keeper import ModeKeeper, Timeouts, Watched
from pneuarm.service.processes.device_slots import LinkedDevice
from pneuarm.service.processes.pipe import (
    Command,
    Heartbeat,
    ModeReply,
    RequestMode,
    SetTarget,
    SetTipPose,
)
from pneuarm.service.safety.monitors.watch import measurement_age_s
from pneuarm.service.safety.safety import Safety

#: Gauge pressure below which a chamber counts as vented, Pa: ten times the sensors' noise.
NEAR_ZERO_PA = 2000.0

#: What the guard changed, and the field that counts the ticks in which it did.
_GUARD_COUNTS = tuple(
    (int(kind), f"guard_{kind.name.lower()}") for kind in Intervention if kind.name
)

#: What may happen in every tick is told this often at most.
_TELL_EVERY_NS = 10_000_000_000


@dataclass(frozen=True)
class LoopSettings:
    """What the loop needs to know; ``start_unix_ns`` is UTC at ``start_ns`` on the loop's time."""

    period_s: float
    control: ControlSettings
    timeouts: Timeouts
    monitors: MonitorSettings
    start_ns: int
    start_unix_ns: int
    supply_flow_max_pa_s: float = inf
    reference: ReferenceLimits = field(default_factory=ReferenceLimits)
    feedback: FeedbackSettings = field(default_factory=FeedbackSettings)

    @classmethod
    def of(
        cls, configuration: Configuration, timeouts: Timeouts, start_ns: int, start_unix_ns: int
    ) -> "LoopSettings":
        """Return what a configuration says; the timeouts are the caller's."""
        return cls(
            period_s=1.0 / configuration.control.rate_hz,
            control=configuration.control.settings(),
            timeouts=timeouts,
            monitors=configuration.monitors.settings(),
            start_ns=start_ns,
            start_unix_ns=start_unix_ns,
            supply_flow_max_pa_s=configuration.hardware.supply_flow_limit_pa_s,
            reference=configuration.reference.limits(),
            feedback=configuration.feedback.settings(),
        )


@dataclass(frozen=True)
class Timing:
    """What the clock says of this waking; ``compute_s`` is of the tick before."""

    late_s: float = 0.0
    compute_s: float = 0.0
    overruns: int = 0


class Loop:
    """The control loop of one arm, without a clock."""

    def __init__(
        self,
        arm: Arm,
        settings: LoopSettings,
        hardware: Hardware | LinkedDevice,
        emit: Callable[[pb.Event], None],
    ) -> None:
        self._settings = settings
        self._hardware = _guarded(hardware, arm, settings)
        self._controller = Controller(arm, settings.control)
        self._estimator = Estimator(arm)
        self._keeper = ModeKeeper(settings.timeouts, self._stamped(emit))
        self._safety = Safety(arm, settings.monitors, self._keeper)
        self._steering = Steering(
            arm,
            self._controller,
            settings.reference,
            settings.feedback,
            settings.period_s,
            self._keeper.tell,
        )
        self._tick = new_tick(arm.n_sections)
        self._record = self._tick.reshape(1).view(np.uint8).data
        self._low = arm.per_chamber("pressure_min_pa")
        self._high = arm.per_chamber("pressure_max_pa")
        self._tool_m = np.array(arm.tool_m)
        self._sent = self._wanted = np.zeros((arm.n_sections, 3))
        self._target: SetTarget | None = None
        self._tip_pose: SetTipPose | None = None
        self._heartbeat_ns: int | None = None
        self._operator = False
        self._interventions = 0
        self._told_fallbacks = self._tell_again_ns = 0
        self._now_ns = self._last_ns = settings.start_ns
        self.sequence = 0

    def _stamped(self, emit: Callable[[pb.Event], None]) -> Callable[[pb.Event], None]:
        def stamp(event: pb.Event) -> None:
            event.time_unix_ns = self._unix_ns()
            emit(event)

        return stamp

    def _unix_ns(self) -> int:
        return self._settings.start_unix_ns + self._now_ns - self._settings.start_ns

    @property
    def mode(self) -> Mode:
        """The mode after the last tick."""
        return self._keeper.mode

    @property
    def pressure_near_zero(self) -> bool:
        """Whether every measured pressure of the last tick was near zero."""
        measured = self._tick["pressure_measured_pa"].reshape(-1).tolist()
        return all(-NEAR_ZERO_PA < pressure < NEAR_ZERO_PA for pressure in measured)

    def warm_up(self) -> None:
        """Go once through everything before the first tick, so that no tick pays for first uses."""
        now_s = self._now_ns * 1e-9
        self._controller.warm_up()
        self._hardware.read(now_s)
        # The second reading has time to pass between: a simulated arm runs its physics once.
        now_s += 1e-6
        self._fill(self._hardware.read(now_s), self._sent)
        self._controller.binding()
        self._hardware.write(self._sent, now_s, now_s)
        self._hardware.vent(now_s)

    def start_at(self, now_ns: int) -> None:
        """Say what time it is before the first tick."""
        self._now_ns = self._last_ns = now_ns

    def vent(self, cause: str) -> None:
        """Leave active or hold, to idle."""
        self._keeper.apply(ModeEvent.VENT, self._now_ns * 1e-9, cause=cause)

    def announce(self, level: "pb.Level", code: str, text: str) -> None:
        """Tell something that changes no mode."""
        self._keeper.tell(level, code, text)

    def _fault(self, error: Exception) -> None:
        """Latch a fault and vent at once; where even that fails, the next tick tries again."""
        cause, now_s = f"{type(error).__name__}: {error}", self._now_ns * 1e-9
        self._sent = np.zeros_like(self._sent)
        self._tick["pressure_sent_pa"] = self._tick["pressure_commanded_pa"] = self._sent
        try:
            self._hardware.vent(now_s)
        except Exception as vent_error:
            cause += f"; the device could not be vented: {vent_error}"
            self._tick["pressure_sent_pa"] = np.nan
        self._safety.failed(error, cause, now_s)

    def tick(
        self, now_ns: int, commands: list[Command], disk: Disk, timing: Timing
    ) -> tuple[memoryview, list[ModeReply]]:
        """Run one tick at ``now_ns``; return its record and the replies to mode requests.

        The record is a view that the next tick overwrites.
        """
        dt_s = (now_ns - self._last_ns) * 1e-9
        self._now_ns = self._last_ns = now_ns
        self.sequence += 1
        self._fill_heading(timing)
        replies: list[ModeReply] = []
        try:
            self._run(commands, replies, dt_s, disk)
            self._safety.worked()
        except Exception as error:  # whatever it is: an arm that nobody controls must lose its air
            self._fault(error)
        self._tick["active_faults"] = self._safety.bits
        self._tick["mode"] = int(self._keeper.mode)
        return self._record, replies

    def _run(
        self, commands: list[Command], replies: list[ModeReply], dt_s: float, disk: Disk
    ) -> None:
        now_s = self._now_ns * 1e-9
        self._tick["pressure_measured_pa"] = np.nan  # a record of a failed reading shows no old one
        self._tick["supply_pa"] = self._tick["measurement_age_s"] = np.nan
        self._tick["tip_commanded_position_m"] = np.nan
        try:
            measurement = self._hardware.read(now_s)
            self._tick["pressure_measured_pa"] = measurement.pressures_pa
        finally:  # a stop is heard and answered also when the device fails
            for command in commands:
                self._take(command, now_s, replies)
        sent = self._hardware.sent_pa
        self._safety.look(measurement, self._tick, self._tip_pose, sent, self._now_ns, dt_s)
        self._watch(now_s, disk)
        ramping = self._safety.ramping_pa(now_s)
        wanted = self._control(dt_s, now_s) if ramping is None else ramping
        self._send(wanted, now_s, ramping is not None)
        self._steering.observe(self._keeper.mode in VENTED_MODES)
        self._fill(measurement, wanted)

    def _take(self, command: Command, now_s: float, replies: list[ModeReply]) -> None:
        match command:
            case Heartbeat():
                self._heartbeat_ns, self._operator = self._now_ns, command.operator
            case SetTipPose():
                self._tip_pose = command
                self._steering.measure(command, self._now_ns)
            case SetTarget():
                # Whatever arrives before the arm is active is dropped, not kept for later.
                if self._keeper.mode == Mode.ACTIVE:
                    self._target = command
                    self._steering.set_target(command)
            case RequestMode():
                replies.append(self._request(command, now_s))

    def _request(self, request: RequestMode, now_s: float) -> ModeReply:
        before = self._keeper.mode
        if request.event in (ModeEvent.LEASE_LOST, ModeEvent.LEASE_RELEASED):
            # Released before a first target: the arm stays armed for the next operator.
            if request.event == ModeEvent.LEASE_LOST or self._target is not None:
                self._keeper.apply(request.event, now_s, request.client)
            reason = ""
        else:
            blocked = self._safety.why_not(request.event, now_s)
            reason = self._keeper.request(request.event, now_s, request.client, blocked)
        if before != Mode.ACTIVE and self._keeper.mode == Mode.ACTIVE:
            self._arm(before)
        return ModeReply(request.request_id, not reason, reason, self._keeper.mode, self.sequence)

    def _arm(self, before: Mode) -> None:
        """Start without a jump: from what is held, else from the measurement."""
        if before != Mode.HOLD:
            # Kept too, for a hold that comes before the first step.
            self._wanted = np.clip(self._tick["pressure_measured_pa"], self._low, self._high)
        self._steering.start_from(self._wanted)
        self._target = None

    def _watch(self, now_s: float, disk: Disk) -> None:
        heartbeat_ns = self._settings.start_ns if self._heartbeat_ns is None else self._heartbeat_ns
        self._keeper.watch(
            now_s,
            Watched(
                target_age_s=self._target_age_s(),
                gateway_age_s=(self._now_ns - heartbeat_ns) * 1e-9,
                operator=self._operator,
                disk=disk,
                pressure_near_zero=self.pressure_near_zero,
            ),
        )
        if self._keeper.mode != Mode.ACTIVE and self._target is not None:
            self._target = None
            self._steering.stop()

    def _target_age_s(self) -> float | None:
        if self._target is None:
            return None
        return max(0.0, (self._now_ns - self._target.received_ns) * 1e-9)

    def _control(self, dt_s: float, now_s: float) -> Array:
        """Return the pressures wanted now, by mode."""
        if self._keeper.mode == Mode.ACTIVE:
            wanted = self._steering.step(dt_s)
            self._tell_fallbacks()
            self._tick["tip_commanded_position_m"] = self._steering.tip_m
            setpoints = self._steering.sent_pa(wanted, dt_s, now_s)
            return self._kept(wanted, setpoints)
        if self._keeper.mode == Mode.HOLD:
            return self._wanted  # what the chambers have or are about to have, without any lead
        return self._sent  # in the vented modes it is zero already

    def _kept(self, wanted: Array, setpoints: Array) -> Array:
        """Keep what is wanted for a hold; return its setpoints, whose lead stays in the limits.

        What is wanted outside of them, or is no number, is for the guard to see and to count.
        """
        in_range = np.minimum(np.maximum(wanted, self._low), self._high)
        if (in_range == wanted).all():  # never true of a NaN
            self._wanted = wanted
            return np.minimum(np.maximum(setpoints, self._low), self._high)
        return wanted

    def _tell_fallbacks(self) -> None:
        """Tell that the QP gave nothing and the damped law went on, once in a while."""
        count, now_ns = self._controller.fallbacks, self._now_ns
        if count > self._told_fallbacks and now_ns >= self._tell_again_ns:
            self._keeper.tell(
                pb.WARNING,
                "qp_fallback",
                f"the QP gave no usable step, the damped law went on instead; {count} times so far",
            )
            self._told_fallbacks, self._tell_again_ns = count, now_ns + _TELL_EVERY_NS

    def _send(self, wanted: Array, now_s: float, ramping: bool) -> None:
        if self._keeper.mode in VENTED_MODES and not ramping:
            self._hardware.vent(now_s)
            self._sent = np.zeros_like(self._sent)
            self._tick["guard_intervention"] = 0
            return
        guarded = self._hardware.write(wanted, now_s, now_s)
        self._sent = guarded.pressures_pa
        self._count(int(guarded.intervention))

    def _count(self, intervention: int) -> None:
        self._tick["guard_intervention"] = intervention
        if intervention:
            self._interventions += 1
            for bit, name in _GUARD_COUNTS:
                if intervention & bit:
                    self._tick[name] += 1

    def _fill_heading(self, timing: Timing) -> None:
        """Write down what is known of every tick, even of one that fails."""
        tick = self._tick
        tick["sequence"] = self.sequence
        tick["time_unix_ns"] = self._unix_ns()
        tick["wake_latency_s"] = timing.late_s
        tick["compute_s"] = timing.compute_s
        tick["overruns"] = timing.overruns

    def _fill(self, measurement: Measurement, wanted: Array) -> None:
        """Write down everything about this tick."""
        tick, controller = self._tick, self._controller
        tick["length_commanded_m"] = controller.lengths_m
        tick["pressure_commanded_pa"] = wanted
        tick["pressure_sent_pa"] = self._hardware.sent_pa
        tick["guard_interventions"] = self._interventions
        tick["qp_fallbacks"] = controller.fallbacks
        tick["supply_pa"] = measurement.supply_pa
        tick["measurement_age_s"] = measurement_age_s(measurement, self._now_ns * 1e-9)
        self._fill_estimate(measurement)
        self._fill_target()
        if measurement.true_tip is not None:
            position, rotation = measurement.true_tip
            tick["tip_true_position_m"] = position + rotation @ self._tool_m
            tick["tip_true_orientation_xyzw"] = quaternion_from_rotation(rotation)
        if self._tip_pose is not None:
            tick["tip_measured_position_m"] = self._tip_pose.position_m
            tick["tip_measured_orientation_xyzw"] = self._tip_pose.quaternion_xyzw
            tick["tip_measured_age_s"] = (self._now_ns - self._tip_pose.received_ns) * 1e-9

    def _fill_estimate(self, measurement: Measurement) -> None:
        lengths = self._estimator.lengths_m(measurement.pressures_pa, measurement.lengths_m)
        tip = self._estimator.tip_estimate(lengths, measurement.lengths_m, self._steering.observer)
        self._tick["length_measured_m"] = measurement.lengths_m
        self._tick["length_estimated_m"] = lengths
        self._steering.fill(self._tick, tip)

    def _fill_target(self) -> None:
        tick, controller, target = self._tick, self._controller, self._target
        tick["law"] = int(controller.law_name)
        tick["reach"] = int(controller.reach)
        tick["target_error_m"] = controller.error_m
        stuck = controller.reach == Reach.OUT_OF_REACH
        tick["binding_limits"] = int(controller.binding()) if stuck else 0
        tick["target_position_m"] = np.nan
        tick["target_orientation_xyzw"] = np.nan
        if target is None:
            tick["target_kind"] = int(TargetKind.NONE)
            tick["target_age_s"] = 0.0
            return
        tick["target_kind"] = int(KIND_OF[type(target.target)])
        tick["target_sequence"] = target.sequence
        tick["target_age_s"] = self._target_age_s()
        position, quaternion = self._steering.goal()
        tick["target_position_m"] = position
        if quaternion is not None:
            tick["target_orientation_xyzw"] = quaternion


def _guarded(
    hardware: Hardware | LinkedDevice, arm: Arm, settings: LoopSettings
) -> GuardedHardware:
    """Put the guard right before the device; one in a process of its own has it there."""
    if isinstance(hardware, LinkedDevice):
        return hardware
    guard = Guard(arm, settings.period_s, settings.supply_flow_max_pa_s)
    return GuardedDevice(hardware, guard, arm.n_sections)

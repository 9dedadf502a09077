"""One tick: read, take commands, look for faults, watch the mode, command, send, estimate, record.

The time is an argument: the same loop runs on the clock, and in simulated time in the tests.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, nan

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.feedback.observer import FeedbackSettings
from pneuarm.controllers.laws.settings import ControlSettings
from pneuarm.controllers.reference.trajectory import ReferenceLimits
from pneuarm.hardware.guard import Guard
from pneuarm.hardware.guarded import GuardedDevice, GuardedHardware
from pneuarm.hardware.interface import Hardware, Measurement
from pneuarm.logs.rings.status import Disk
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.configuration.tables.monitors import MonitorsConfig
from pneuarm.service.control.once import Once
from pneuarm.service.control.record import (
    Estimate,
    GuardCounts,
    Heading,
    Tick,
    ValveCommand,
    record_of,
)
from pneuarm.service.control.steering import Steering
from pneuarm.service.modes.mode import VENTED_MODES, Mode, ModeEvent
from pneuarm.service.modes.mode_keeper import Conditions, ModeKeeper, Notice, Timeouts
from pneuarm.service.monitors.measurement_age import measurement_age_s
from pneuarm.service.processes.device_slots import LinkedDevice
from pneuarm.service.processes.pipe import (
    Command,
    Heartbeat,
    ModeReply,
    RequestMode,
    SetTarget,
    SetTipPose,
)
from pneuarm.service.safety.safety import Safety

#: Gauge pressure below which a chamber counts as vented, Pa: ten times the sensors' noise.
NEAR_ZERO_PA = 2000.0


@dataclass(frozen=True)
class LoopSettings:
    """What the loop needs to know; ``start_unix_ns`` is UTC at ``start_ns`` on the loop's time."""

    period_s: float
    control: ControlSettings
    timeouts: Timeouts
    monitors: MonitorsConfig
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
            monitors=configuration.monitors,
            start_ns=start_ns,
            start_unix_ns=start_unix_ns,
            supply_flow_max_pa_s=configuration.hardware.supply_flow_limit_pa_s,
            reference=configuration.reference.limits(),
            feedback=configuration.feedback.settings(),
        )


@dataclass(frozen=True)
class Timing:
    """What is known of this waking from outside of the loop; ``compute_s`` is of the tick before.

    ``log_missed`` is how many ticks and messages the recorder has lost.
    """

    late_s: float = 0.0
    compute_s: float = 0.0
    overruns: int = 0
    log_missed: int = 0


@dataclass(slots=True)
class Received:
    """What has arrived so far: newest target while active, newest tip pose, newest heartbeat."""

    heartbeat_ns: int
    operator: bool = False
    target: SetTarget | None = None
    tip_pose: SetTipPose | None = None

    def target_age_s(self, now_ns: int) -> float | None:
        """Return the age of the target, None without one."""
        return None if self.target is None else max(0.0, (now_ns - self.target.received_ns) * 1e-9)


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
        self._modes = ModeKeeper(settings.timeouts, self._stamped(emit))
        self._safety = Safety(arm, settings.monitors, self._modes)
        self._steering = Steering(
            arm, settings.control, settings.reference, settings.feedback, settings.period_s
        )
        self._once = Once()
        self._received = Received(settings.start_ns)
        self._tool_m = np.array(arm.tool_m)
        self._zeros = np.zeros((arm.n_sections, 3))
        self._zeros.setflags(write=False)
        self._allowed_pa = self._zeros  # what the guard let through last
        self._now_ns = settings.start_ns
        self._tick = Tick(
            heading=Heading(0, settings.start_unix_ns, 0.0, 0.0, 0, 0),
            mode=self._modes.mode,
            active_faults=0,
            measured_pa=None,
            supply_pa=nan,
            measurement_age_s=nan,
            tip_commanded_m=None,
            commanded_pa=self._zeros,
            sent_pa=None,
            guard=GuardCounts(),
            steered=self._steering.steered(),
        )

    @property
    def mode(self) -> Mode:
        """The mode after the last tick."""
        return self._modes.mode

    @property
    def pressure_near_zero(self) -> bool:
        """Whether every measured pressure of the last tick was near zero."""
        return _near_zero(self._tick.measured_pa)

    def warm_up(self) -> None:
        """Go once through everything before the first tick, so that no tick pays for first uses."""
        now_s = self._now_ns * 1e-9
        self._steering.warm_up()
        self._hardware.read(now_s)
        # The second reading has time to pass between: a simulated arm runs its physics once.
        now_s += 1e-6
        measurement = self._hardware.read(now_s)
        estimate = self._steering.estimate(measurement)
        self._tick = self._tick._replace(
            steered=self._steering.steered(), measurement=measurement, estimate=estimate
        )
        record_of(self._tick, self._tool_m)
        self._hardware.write(self._allowed_pa, now_s, now_s)
        self._hardware.vent(now_s)

    def start_at(self, now_ns: int) -> None:
        """Say what time it is before the first tick."""
        self._now_ns = now_ns

    def vent(self, cause: str) -> None:
        """Leave active or hold, to idle."""
        self._modes.apply(ModeEvent.VENT, self._now_ns * 1e-9, cause=cause)

    def announce(self, notice: Notice) -> None:
        """Tell something that changes no mode."""
        self._modes.tell(notice)

    def tick(
        self, now_ns: int, commands: list[Command], disk: Disk, timing: Timing
    ) -> tuple[bytes, list[ModeReply]]:
        """Run one tick at ``now_ns``; return its record and the replies to mode requests."""
        dt_s, self._now_ns = (now_ns - self._now_ns) * 1e-9, now_ns
        now_s = now_ns * 1e-9
        heading = self._heading(timing)
        measurement, command = None, None
        replies: list[ModeReply] = []
        try:
            try:
                measurement = self._hardware.read(now_s)
            finally:  # a stop is heard and answered also when the device fails
                self._take(commands, measurement, replies)
            self._look_for_faults(measurement, timing.overruns, dt_s)
            self._watch_the_mode(measurement, disk)
            command = self._command(dt_s, now_s)
            guard = self._send(command, now_s)
            self._tell(self._steering.observe(self.mode in VENTED_MODES))
            estimate = self._steering.estimate(measurement)
            for notice in self._once.due(now_s):
                self._modes.tell(notice)
            self._safety.worked()
            self._tick = self._whole(heading, measurement, command, guard, estimate)
        except Exception as error:  # whatever it is: an arm that nobody controls must lose its air
            self._tick = self._failed(heading, measurement, command, error)
        return record_of(self._tick, self._tool_m), replies

    def _heading(self, timing: Timing) -> Heading:
        sequence = self._tick.heading.sequence + 1
        return Heading(
            sequence,
            self._unix_ns(),
            timing.late_s,
            timing.compute_s,
            timing.overruns,
            timing.log_missed,
        )

    def _take(
        self, commands: list[Command], measurement: Measurement | None, replies: list[ModeReply]
    ) -> None:
        """Take every command, also those behind one that fails; then raise what has failed."""
        failed: Exception | None = None
        for command in commands:
            try:
                self._take_one(command, measurement, replies)
            except Exception as error:  # a stop that comes behind it must be heard
                failed = failed or error
        if failed is not None:
            raise failed

    def _take_one(
        self, command: Command, measurement: Measurement | None, replies: list[ModeReply]
    ) -> None:
        received = self._received
        match command:
            case Heartbeat():
                received.heartbeat_ns, received.operator = self._now_ns, command.operator
            case SetTipPose():
                received.tip_pose = command
                self._tell(self._steering.measure(command, self._now_ns))
            case SetTarget():
                # Whatever arrives before the arm is active is dropped, not kept for later.
                if self.mode == Mode.ACTIVE:
                    received.target = command
                    self._tell(self._steering.set_target(command))
            case RequestMode():
                replies.append(self._answer(command, measurement))

    def _answer(self, request: RequestMode, measurement: Measurement | None) -> ModeReply:
        before, now_s, reason = self.mode, self._now_ns * 1e-9, ""
        if request.event in (ModeEvent.LEASE_LOST, ModeEvent.LEASE_RELEASED):
            # Released before a first target: the arm stays armed for the next operator.
            if request.event == ModeEvent.LEASE_LOST or self._received.target is not None:
                self._modes.apply(request.event, now_s, request.client)
        else:
            blocked = self._safety.why_not(request.event, now_s)
            reason = self._modes.request(request.event, now_s, request.client, blocked)
        if before != Mode.ACTIVE and self.mode == Mode.ACTIVE:
            self._start(before, measurement)
        sequence = self._tick.heading.sequence + 1
        return ModeReply(request.request_id, not reason, reason, self.mode, sequence)

    def _start(self, before: Mode, measurement: Measurement | None) -> None:
        """Start without a jump: from what is held, else from the measurement."""
        if before == Mode.HOLD:
            self._steering.start(None)
        else:
            unknown_pa = np.full_like(self._zeros, nan)
            self._steering.start(unknown_pa if measurement is None else measurement.pressures_pa)
        self._received.target = None

    def _look_for_faults(self, measurement: Measurement, overruns: int, dt_s: float) -> None:
        """Let the monitors look at this measurement, and at what there was before it."""
        estimate = self._tick.estimate
        self._safety.look(
            measurement,
            self._hardware.sent_pa,
            np.full_like(self._zeros, nan) if estimate is None else estimate.lengths_m,
            self._received.tip_pose,
            overruns,
            self._now_ns,
            dt_s,
        )

    def _watch_the_mode(self, measurement: Measurement, disk: Disk) -> None:
        """Let time and the other processes change the mode."""
        received, now_ns = self._received, self._now_ns
        self._modes.watch(
            now_ns * 1e-9,
            Conditions(
                target_age_s=received.target_age_s(now_ns),
                gateway_age_s=(now_ns - received.heartbeat_ns) * 1e-9,
                operator=received.operator,
                disk=disk,
                pressure_near_zero=_near_zero(measurement.pressures_pa),
            ),
        )
        if self.mode != Mode.ACTIVE and received.target is not None:
            received.target = None
            self._steering.stop()

    def _command(self, dt_s: float, now_s: float) -> ValveCommand:
        """Return what the valves are to be told now, by mode."""
        ramping_pa = self._safety.ramping_pa(now_s)
        if ramping_pa is not None:
            return ValveCommand(ramping_pa, vents=False)
        if self.mode == Mode.ACTIVE:
            setpoints_pa = self._steering.step(dt_s, now_s)
            self._tell(self._steering.fallback_notice(now_s))
            return ValveCommand(setpoints_pa, vents=False, tip_m=self._steering.tip_m)
        if self.mode == Mode.HOLD:
            return ValveCommand(self._steering.held_pa, vents=False)
        return ValveCommand(self._allowed_pa, vents=True)

    def _send(self, command: ValveCommand, now_s: float) -> GuardCounts:
        """Send it through the guard, or vent past it; return what the guard has done by now."""
        if command.vents:
            self._hardware.vent(now_s)
            self._allowed_pa = self._zeros
            return self._tick.guard.after(0)
        guarded = self._hardware.write(command.pressures_pa, now_s, now_s)
        self._allowed_pa = guarded.pressures_pa
        return self._tick.guard.after(int(guarded.intervention))

    def _whole(
        self,
        heading: Heading,
        measurement: Measurement,
        command: ValveCommand,
        guard: GuardCounts,
        estimate: Estimate,
    ) -> Tick:
        """Return a tick in which nothing failed."""
        received, now_ns = self._received, self._now_ns
        target, pose = received.target, received.tip_pose
        followed = self._tick.last_target_sequence if target is None else target.sequence
        return Tick(
            heading=heading,
            mode=self.mode,
            active_faults=self._safety.bits,
            measured_pa=measurement.pressures_pa,
            supply_pa=measurement.supply_pa,
            measurement_age_s=measurement_age_s(measurement, now_ns * 1e-9),
            tip_commanded_m=command.tip_m,
            commanded_pa=command.pressures_pa,
            sent_pa=self._hardware.sent_pa,
            guard=guard,
            steered=self._steering.steered(),
            measurement=measurement,
            estimate=estimate,
            target=target,
            target_age_s=received.target_age_s(now_ns) or 0.0,
            last_target_sequence=followed,
            tip_pose=pose,
            tip_pose_age_s=0.0 if pose is None else (now_ns - pose.received_ns) * 1e-9,
        )

    def _failed(
        self,
        heading: Heading,
        measurement: Measurement | None,
        command: ValveCommand | None,
        error: Exception,
    ) -> Tick:
        """Vent at once and latch a fault; where even that fails, the next tick tries again."""
        cause, now_s = f"{type(error).__name__}: {error}", self._now_ns * 1e-9
        sent_pa: Array | None = self._zeros
        self._allowed_pa = self._zeros
        try:
            self._hardware.vent(now_s)
        except Exception as vent_error:
            cause += f"; the device could not be vented: {vent_error}"
            sent_pa = None
        self._safety.failed(error, cause, now_s)
        return self._tick._replace(
            heading=heading,
            mode=self.mode,
            active_faults=self._safety.bits,
            measured_pa=None if measurement is None else measurement.pressures_pa,
            supply_pa=nan,
            measurement_age_s=nan,
            tip_commanded_m=None if command is None else command.tip_m,
            commanded_pa=self._zeros,
            sent_pa=sent_pa,
        )

    def _tell(self, notice: Notice | None) -> None:
        """Tell what may come again in any tick: once, then how often."""
        if notice is not None:
            news = self._once.take(notice, self._now_ns * 1e-9)
            if news is not None:
                self._modes.tell(news)

    def _stamped(self, emit: Callable[[pb.Event], None]) -> Callable[[pb.Event], None]:
        def stamp(event: pb.Event) -> None:
            event.time_unix_ns = self._unix_ns()
            emit(event)

        return stamp

    def _unix_ns(self) -> int:
        return self._settings.start_unix_ns + self._now_ns - self._settings.start_ns


def _near_zero(pressures_pa: Array | None) -> bool:
    """Whether every pressure is near zero; those that are not known are not."""
    if pressures_pa is None:
        return False
    pressures = pressures_pa.reshape(-1).tolist()
    return all(-NEAR_ZERO_PA < pressure < NEAR_ZERO_PA for pressure in pressures)


def _guarded(
    hardware: Hardware | LinkedDevice, arm: Arm, settings: LoopSettings
) -> GuardedHardware:
    """Put the guard right before the device; one in a process of its own has it there."""
    if isinstance(hardware, LinkedDevice):
        return hardware
    guard = Guard(arm, settings.period_s, settings.supply_flow_max_pa_s)
    return GuardedDevice(hardware, guard, arm.n_sections)

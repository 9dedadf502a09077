"""The control process: the loop on the clock, at real-time priority.

It imports neither zenoh, rerun nor mcap, and waits for nobody but the clock.
"""

import os
import socket
import time
from multiprocessing.connection import Connection

from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.interface import Hardware
from pneuarm.logs.rings.ring import RingWriter
from pneuarm.logs.rings.rings import MessageWriter
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import EVENT
from pneuarm.service.control.clock import Clock
from pneuarm.service.control.loop import Loop, LoopSettings, Timing
from pneuarm.service.devices import registry as backends
from pneuarm.service.modes.mode_keeper import Notice, Timeouts
from pneuarm.service.processes import realtime
from pneuarm.service.processes.device_slots import LinkedDevice
from pneuarm.service.processes.pipe import Command, ModeReply, Pipe, Shutdown
from pneuarm.service.processes.shared import REALTIME, START_FAILED, Shared, ignore_terminal_signals
from pneuarm.service.processes.telling import Telling

#: How long the loop goes on venting after it was told to end, at most.
VENT_BEFORE_END_S = 2.0

#: From each pipe; a flood of targets delays nobody else's request.
_COMMANDS_PER_TICK = 16


class ControlProcess:
    """Runs the loop until the supervisor says to end, or is gone."""

    def __init__(self, shared: Shared, supervisor: Pipe, requests: Pipe, stream: Pipe) -> None:
        self._shared, self._supervisor = shared, supervisor
        self._requests, self._stream = requests, stream
        configuration = shared.configuration
        control = configuration.control
        arm = configuration.build_arm()
        self._ring = RingWriter(shared.rings.ticks)
        self._events = MessageWriter(shared.rings.control)
        self._telling = Telling(self._write)
        self._hardware: Hardware | LinkedDevice = (
            backends.build(configuration, arm)
            if shared.device is None
            else LinkedDevice(shared.device)
        )
        timeouts = Timeouts(
            target_s=control.target_timeout_ms * 1e-3,
            arming_s=control.arming_timeout_s,
            hold_s=control.hold_timeout_s,
            full_disk_vent_s=configuration.log.full_disk_vent_s,
        )
        settings = LoopSettings.of(configuration, timeouts, shared.start_ns, shared.start_unix_ns)
        self._loop = Loop(arm, settings, self._hardware, self._emit)
        self._ending_since_ns: int | None = None

    def _emit(self, event: pb.Event) -> None:
        self._telling.tell(event)

    def _write(self, event: pb.Event) -> None:
        self._events.write(EVENT, event, event.time_unix_ns)

    def run(self) -> None:
        """Connect, run, and leave the arm vented, whatever happens in between."""
        control = self._shared.configuration.control
        self._hardware.connect()
        try:
            granted = realtime.take_priority(control.priority)
            self._prepare()
            locked = realtime.lock_memory()
            realtime.freeze_garbage()
            self._report(granted, locked)
            self._cycle(Clock(control.rate_hz, control.spin_us))
        finally:
            self._hardware.vent(time.monotonic_ns() * 1e-9)
            self._hardware.close()

    def _prepare(self) -> None:
        """Warm up; raises SystemExit where the device fails: the supervisor ends the start then."""
        try:
            self._loop.start_at(time.monotonic_ns())
            self._loop.warm_up()
        except HardwareError as error:
            self._loop.announce(Notice(pb.ERROR, START_FAILED, str(error)))
            raise SystemExit(1) from error

    def _cycle(self, clock: Clock) -> None:
        timing, overruns, compute_s = Timing(), 0, 0.0
        while not self._is_over():
            wake = clock.wait()
            begin = time.monotonic_ns()
            overruns += wake.skipped
            timing = Timing(wake.late_ns * 1e-9, compute_s, overruns, self._shared.recorder.missed)
            self._tick(wake.due_ns, timing)
            compute_s = (time.monotonic_ns() - begin) * 1e-9

    def _tick(self, due_ns: int, timing: Timing) -> None:
        commands = self._receive(due_ns)
        disk = self._shared.recorder.disk
        record, replies = self._loop.tick(due_ns, commands, disk, timing)
        self._ring.write(record)
        for reply in replies:
            self._reply(reply)
        self._telling.step(self._shared.unix_ns(due_ns))

    def _reply(self, reply: ModeReply) -> None:
        """Answer whoever asked: even numbers are the gateway's, odd ones the supervisor's."""
        pipe = self._supervisor if reply.request_id % 2 else self._requests
        pipe.send(reply)

    def _receive(self, now_ns: int) -> list[Command]:
        """Take what has arrived; once the end has begun nothing counts any more."""
        commands: list[Command] = []
        for pipe in (self._supervisor, self._requests, self._stream):
            for _ in range(_COMMANDS_PER_TICK):
                try:
                    message = pipe.receive()
                except Exception as error:  # what cannot be read is no reason to let go of the arm
                    self._loop.announce(_unreadable(error))
                    continue
                if message is None:
                    break
                if isinstance(message, Shutdown):
                    self._begin_ending(now_ns)
                elif not isinstance(message, ModeReply):
                    commands.append(message)
        if self._supervisor.closed:
            self._begin_ending(now_ns)
        return [] if self._ending_since_ns is not None else commands

    def _begin_ending(self, now_ns: int) -> None:
        if self._ending_since_ns is None:
            self._ending_since_ns = now_ns
            self._loop.vent("the daemon ends")

    def _is_over(self) -> bool:
        """After the order to end: over as soon as the arm is empty, or the time for it is up."""
        if self._ending_since_ns is None:
            return False
        waited_s = (time.monotonic_ns() - self._ending_since_ns) * 1e-9
        return self._loop.pressure_near_zero or waited_s > VENT_BEFORE_END_S

    def _report(self, granted: bool, locked: bool) -> None:
        priority = self._shared.configuration.control.priority
        text = f"priority {priority} granted" if granted else "priority not granted"
        memory = "memory locked" if locked else "memory not locked"
        self._loop.start_at(time.monotonic_ns())
        level = pb.INFO if granted else pb.WARNING
        self._loop.announce(Notice(level, REALTIME, f"real-time {text}, {memory}"))


def _unreadable(error: Exception) -> Notice:
    return Notice(
        pb.ERROR,
        "command_unreadable",
        "a message from another process of the daemon cannot be read, and was left out",
        f"{type(error).__name__}: {error}",
        "report it with the log",
    )


def main(
    shared: Shared,
    supervisor: Pipe,
    requests: Pipe,
    stream: Pipe,
    arm_lock: socket.socket,
    device_lock: socket.socket,
    end: Connection,
) -> None:
    """Entry point of the process.

    The locks are held here too: while this process lives, no other daemon gets the device. The
    order to end comes through the supervisor's pipe, not through ``end``.
    """
    ignore_terminal_signals()
    ControlProcess(shared, supervisor, requests, stream).run()
    os._exit(0)  # frozen garbage is never collected, and libraries would complain of that

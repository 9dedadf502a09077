"""The supervisor: starts, watches and ends the processes, and can vent the device by itself."""

import contextlib
import faulthandler
import os
import select
import signal
import socket
import time
from collections.abc import Callable
from functools import partial
from multiprocessing import get_context

from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.logs.recording.session import part_path, session_name
from pneuarm.logs.rings.ring import RingReader
from pneuarm.logs.rings.rings import MessageReader, MessageWriter, Rings
from pneuarm.logs.rings.status import RecorderStatus, ViewerStatus
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import EVENT
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.daemon.announce import Announcer, start_facts
from pneuarm.service.daemon.info import info_of
from pneuarm.service.daemon.local_stop import Callers, listen
from pneuarm.service.daemon.log_watch import LogWatch
from pneuarm.service.daemon.repair import start_mending
from pneuarm.service.daemon.requirements import check_machine, check_ports, make_directory
from pneuarm.service.daemon.sd_notify import ServiceManager
from pneuarm.service.devices import registry as backends
from pneuarm.service.devices.keeper import DeviceKeeper
from pneuarm.service.modes.mode import ModeEvent
from pneuarm.service.processes.child import Child
from pneuarm.service.processes.device_slots import DeviceLink
from pneuarm.service.processes.lock import lock
from pneuarm.service.processes.pipe import ModeReply, Pipe, RequestMode, Shutdown, new_pipe
from pneuarm.service.processes.shared import ENDING_SIGNALS, REALTIME, START_FAILED, Shared
from pneuarm.service.processes.usage import ProcessTable

_PERIOD_S = 0.02

#: A control process without a tick for this long is dead or stopped.
HEARTBEAT_S = 0.1
#: A slow or busy machine needs long to load and compile what a tick needs; a service manager waits
#: for a minute.
_FIRST_TICK_S = 50.0
_END_S = 5.0

#: A recorder that still gets further after this much of the end asks for more time than usual.
_LONG_END_S = 10.0

#: The end takes no longer than this, but for a recorder that still gets further: more than all its
#: patience together.
LAST_RESORT_S = 60.0

#: Module of each process, with its `main`.
MODULES = {
    "control": "pneuarm.service.control.process",
    "device": "pneuarm.service.devices.process",
    "gateway": "pneuarm.service.wire.gateway",
    "recorder": "pneuarm.service.daemon.recorder",
    "viewer": "pneuarm.service.daemon.viewer",
}

#: Libraries that would start threads of their own in every process.
_SINGLE_THREADED = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


class Supervisor:
    """One daemon: its locks, its shared memory, its processes."""

    def __init__(self, configuration: Configuration, say: Callable[[str], None]) -> None:
        """Take the locks and check the ports; raises ConfigurationError, nothing started yet."""
        self._say = say
        self._arm_lock = lock("arm", configuration.arm.name)
        self._callers = Callers(listen(configuration.arm.name))
        check_machine(configuration)
        self._device_lock = lock("device", backends.address(configuration))
        check_ports(configuration)
        self._directory = make_directory(configuration)
        os.environ.update(_SINGLE_THREADED)
        self._context = get_context("spawn")
        self._shared = self._share(configuration)
        self._events = MessageWriter(self._shared.rings.supervisor)
        self._log_watch = LogWatch(self._shared.rings, self._shared.recorder)
        self._announcer = Announcer(self._shared.rings, say)
        self._ticks = RingReader(self._shared.rings.ticks)
        self._control_pipe, self._control_end = new_pipe()
        self._requests = new_pipe()
        self._stream = new_pipe()
        self._children: dict[str, Child] = {}
        self._device = self._keep_device(configuration)
        self._stop_asked: dict[int, socket.socket] = {}
        self._request_id = 1
        self._ending = False
        self._service_manager = ServiceManager()

    def _share(self, configuration: Configuration) -> Shared:
        arm = configuration.build_arm()
        start_ns, start_unix_ns = time.monotonic_ns(), time.time_ns()
        session = self._free_name(session_name(start_unix_ns, arm.name))
        path = part_path(self._directory, session, 0)
        shared = Shared(
            configuration=configuration,
            info=info_of(configuration, arm, str(path)),
            session=session,
            start_ns=start_ns,
            start_unix_ns=start_unix_ns,
            rings=Rings.create(self._context, arm.n_sections, configuration.control.rate_hz),
            recorder=RecorderStatus.create(self._context),
            viewer=ViewerStatus.create(self._context),
            processes=ProcessTable.create(self._context),
            device=None
            if backends.in_control(configuration)
            else DeviceLink.create(self._context, arm.n_sections),
        )
        shared.processes.started("supervisor", os.getpid())
        return shared

    def _free_name(self, name: str) -> str:
        """Two sessions within one second get different names."""
        candidate, number = name, 1
        while part_path(self._directory, candidate, 0).exists():
            number += 1
            candidate = f"{name}-{number}"
        return candidate

    def _keep_device(self, configuration: Configuration) -> DeviceKeeper | None:
        """Prepare the device process, where the device has one."""
        if self._shared.device is None:
            return None
        arguments = (self._shared, self._arm_lock, self._device_lock)
        child = Child("device", MODULES["device"], self._context, arguments, self._shared.processes)
        self._children["device"] = child
        return DeviceKeeper(configuration, self._shared.device, child)

    # --- running ---------------------------------------------------------------------------

    def run(self) -> int:
        """Run until SIGINT, SIGTERM or SIGHUP, or until control is lost; return the exit status."""
        for number in ENDING_SIGNALS:
            if signal.getsignal(number) != signal.SIG_IGN:  # as `nohup` sets it
                signal.signal(number, self._on_signal)
        try:
            if self._device is not None:
                self._device.start(lambda: self._ending)
            self._start_control()
            for line in start_facts(self._shared, self._realtime_fact()):
                self._say(line)
            if not self._ending:
                self._start_others()
                for path in start_mending(self._directory, self._context):
                    self._say(f"unfinished {path} was left by a crash; repairing it")
            status = self._watch()
        finally:
            self._end_children()
        recorder = self._children.get("recorder")
        return 1 if status == 0 and recorder is not None and recorder.failed else status

    def _on_signal(self, number: int, frame: object) -> None:
        self._ending = True

    def _start_control(self) -> None:
        """Start control alone, so that nothing delays its first tick, and wait for that.

        Raises HardwareError where it ends before, or does not get there.
        """
        shared, locks = self._shared, (self._arm_lock, self._device_lock)
        control = self._add(
            "control", (shared, self._control_end, self._requests[1], self._stream[1], *locks)
        )
        give_up_s = time.monotonic() + _FIRST_TICK_S
        while not self._ending and control.is_alive() and self._ticks.head() == 0:
            if time.monotonic() > give_up_s:
                raise HardwareError(
                    f"control made no tick within {_FIRST_TICK_S:g} s of its start: this machine "
                    "is too busy or too slow; end other programs and start again"
                )
            time.sleep(0.005)
        if not self._ending and not control.is_alive():
            cause = self._said(START_FAILED) or "see the lines above"
            raise HardwareError(f"the control process ended at its start: {cause}")

    def _realtime_fact(self) -> str:
        """Return what control has said of its priority, as the first thing it says."""
        text = self._said(REALTIME)
        return text.removeprefix("real-time ") if text else "control has not started"

    def _said(self, code: str) -> str:
        """Text of what control has said under a code, empty if nothing."""
        for _, payload, _ in MessageReader((self._shared.rings.control,)).read():
            event = pb.Event.FromString(payload)
            if event.code == code:
                return event.text
        return ""

    def _start_others(self) -> None:
        shared = self._shared
        self._add("gateway", (shared, self._requests[0], self._stream[0]))
        self._add("recorder", (shared,))
        if shared.configuration.rerun.enabled:
            self._add("viewer", (shared,))

    def _add(self, name: str, arguments: tuple[object, ...]) -> Child:
        child = Child(name, MODULES[name], self._context, arguments, self._shared.processes)
        child.start()
        self._children[name] = child
        return child

    def _watch(self) -> int:
        newest, seen_s = 0, time.monotonic()
        while not self._ending:
            self._serve_local_stop(_PERIOD_S)
            self._announcer.step()
            self._look_after_device()
            self._revive()
            self._look_after_log()
            head, now_s = self._ticks.head(), time.monotonic()
            if head != newest:
                newest, seen_s = head, now_s
                self._service_manager.alive(now_s)
            elif now_s - seen_s > HEARTBEAT_S or not self._children["control"].is_alive():
                self._vent_without_control()
                return 3
        return 0

    def _look_after_device(self) -> None:
        """A dead or stuck device process: zero the device from here, until it is there again."""
        if self._device is not None and (failed := self._device.look_after()):
            self._tell(
                pb.ERROR,
                "vent_failed",
                f"the device process is lost and the device could not be vented: {failed}",
                remedy="cut the air supply; the device's own watchdog zeroes it where it has one",
            )

    def _look_after_log(self) -> None:
        """Tell, while it happens, that the log lacks something or is about to."""
        found = self._log_watch.look(time.monotonic())
        if found is not None:
            self._tell(pb.WARNING, found.code, found.text, found.cause, found.remedy)

    def _revive(self) -> None:
        """Start dead processes but control again; the arm goes on, holds, or is in fault."""
        for name, child in self._children.items():
            if name != "control" and child.revive_if_due():
                self._tell(
                    pb.WARNING,
                    f"{name}_restarted",
                    f"the {name} process died and was started again",
                    remedy="see the log for what came before",
                )

    def _vent_without_control(self) -> None:
        """Control is dead or stopped: kill it for good, then zero the device from here."""
        self._service_manager.stopping()  # or its watchdog might cut this short
        self._children["control"].kill()
        cause = "the control process died, or made no tick for 100 ms"
        # A device inside of control is gone with it, and its pressures with that.
        if self._device is not None and (failed := self._device.zero()):
            self._tell(
                pb.ERROR,
                "vent_failed",
                f"control is lost and the device could not be vented: {failed}",
                cause,
                "cut the air supply; the device's own watchdog zeroes it where it has one",
            )
            return
        self._tell(
            pb.ERROR,
            "control_lost",
            "control is lost; the supervisor has vented the arm",
            cause,
            "start the daemon again; report it if it happens twice",
        )

    # --- the stop from this machine --------------------------------------------------------

    def _serve_local_stop(self, timeout_s: float) -> None:
        watched: list[socket.socket | Pipe] = [*self._callers.sockets(), self._control_pipe]
        readable, _, _ = select.select(watched, [], [], timeout_s)
        for connection in self._callers.asking_to_stop(readable):
            self._request_id += 2  # odd: the supervisor's
            self._stop_asked[self._request_id] = connection
            self._control_pipe.send(RequestMode(ModeEvent.ESTOP, self._request_id, "this machine"))
        if self._control_pipe in readable:
            while (message := self._control_pipe.receive()) is not None:
                if isinstance(message, ModeReply):
                    self._confirm(message)

    def _confirm(self, reply: ModeReply) -> None:
        connection = self._stop_asked.pop(reply.request_id, None)
        if connection is not None:
            with connection, contextlib.suppress(OSError):  # whoever asked may have gone
                connection.sendall(b"stopped\n" if reply.accepted else b"refused\n")

    # --- the end ---------------------------------------------------------------------------

    def _end_children(self) -> None:
        """Control first, so that the arm is empty; the recorder last, so that it has all of it."""
        self._service_manager.stopping()
        # Nothing below waits without a limit; should the end stand still all the same, this says
        # where, and ends it: control vents by itself when its supervisor is gone.
        faulthandler.dump_traceback_later(LAST_RESORT_S, exit=True)
        self._end_began_s = time.monotonic()
        control = self._children.get("control")
        if control is not None:
            self._control_pipe.send(Shutdown())
            control.end_if_loading()
            if not control.join(_END_S):
                self._vent_without_control()
        for name in ("device", "gateway", "recorder", "viewer"):
            child = self._children.get(name)
            if child is not None and name != "recorder":  # which has something to write
                child.end_if_loading()
            progress = partial(self._progress, name)
            if child is not None and not child.end(self._patience_s(name), progress):
                self._say(f"WARNING    the {name} process did not end by itself and was killed")
        self._announcer.step()
        if "recorder" in self._children and (lacks := self._log_watch.lacks()):
            self._say(f"WARNING    {lacks}")

    @staticmethod
    def _patience_s(name: str) -> float:
        """How long a process may take to end, or to get further with what it still has to do."""
        return {"recorder": 30.0, "device": 6.0}.get(name, 2.0)

    def _progress(self, name: str) -> object:
        """Say how far a process is; as long as the recorder gets further, nobody ends the end."""
        if name != "recorder":
            return None
        recorded = self._log_watch.recorded()
        if recorded != self._last_recorded and time.monotonic() - self._end_began_s > _LONG_END_S:
            faulthandler.dump_traceback_later(LAST_RESORT_S, exit=True)
            self._service_manager.needs_longer(LAST_RESORT_S)
        self._last_recorded = recorded
        return recorded

    _last_recorded: object = None

    def _tell(
        self, level: "pb.Level", code: str, text: str, cause: str = "", remedy: str = ""
    ) -> None:
        now_ns = self._shared.unix_ns(time.monotonic_ns())
        event = pb.Event(
            time_unix_ns=now_ns,
            level=level,
            source="supervisor",
            code=code,
            text=text,
            cause=cause,
            remedy=remedy,
        )
        self._events.write(EVENT, event, now_ns)

"""Processes of the daemon die or stand still."""

import contextlib
import os
import signal
import time
from collections.abc import Callable

import pytest

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.modes.mode_keeper import GATEWAY_LOST_S, GATEWAY_SILENT_S
from tools.faults.device_faults import ZERO_S
from tools.faults.fault import Fault
from tools.faults.injection import Injection
from tools.faults.rig import Rig
from tools.rig.daemon import enough
from tools.rig.processes import process

#: The wait before a restart doubles from one to the next, to this at most (s); a process that has
#: lived so long is started again at once.
_REVIVED_S, _LIVED_S = 30.0, 6.0

_VIEWED = {"rerun": {"enabled": True, "memory_limit_mib": 32}}


def _grown_up(rig: Rig, name: str) -> int:
    """Return the number of a process once it has lived long enough to be started again soon."""
    pid = rig.pid(name)
    young_s = _LIVED_S - process(pid).lived_s
    rig.wait_until(enough(young_s), f"a {name} that has lived for long enough")
    return pid


def _control(number: int) -> Callable[[Rig, Injection], None]:
    def inject(rig: Rig, injection: Injection) -> None:
        control = rig.pid("control")
        injection.zero_within_s = ZERO_S
        injection.begin()
        os.kill(control, number)
        rig.wait_for_end(injection, 3)
        injection.expect_event("control_lost")

    return inject


def _supervisor_killed(rig: Rig, injection: Injection) -> None:
    injection.must_reach(pb.IDLE, pb.READY)
    injection.zero_within_s = ZERO_S
    injection.begin()
    rig.daemon.send_signal(signal.SIGKILL)
    rig.wait_for_end(injection, -signal.SIGKILL)


def _supervisor_and_control_killed(rig: Rig, injection: Injection) -> None:
    control = rig.pid("control")
    injection.zero_within_s = ZERO_S
    injection.begin()
    rig.daemon.send_signal(signal.SIGKILL)
    os.kill(control, signal.SIGKILL)
    rig.wait_for_end(injection, -signal.SIGKILL)


def _device(number: int) -> Callable[[Rig, Injection], None]:
    """Control goes on without its device: fault; the supervisor zeroes it, and starts another."""

    def inject(rig: Rig, injection: Injection) -> None:
        device = _grown_up(rig, "device")
        injection.must_reach(pb.FAULT, within_s=0.6)
        injection.zero_within_s = ZERO_S
        injection.begin()
        os.kill(device, number)
        rig.wait_until(lambda: rig.pid("device") != device, "another device process", _REVIVED_S)
        rig.wait_for_mode(pb.FAULT)
        rig.wait_until_empty()

    return inject


def _supervisor_stopped(rig: Rig, injection: Injection) -> None:
    injection.begin()
    rig.daemon.send_signal(signal.SIGSTOP)
    try:
        rig.wait_until(enough(0.5), "half a second")
        injection.must_go_on()
        state = rig.watcher.estop()
        injection.check("the network stops the arm meanwhile", state.mode == pb.ESTOP)
    finally:
        rig.daemon.send_signal(signal.SIGCONT)


def _all_killed(rig: Rig, injection: Injection) -> None:
    injection.zero_within_s = ZERO_S
    injection.begin()
    rig.daemon.send_signal_to_all(signal.SIGKILL)
    rig.wait_for_end(injection, -signal.SIGKILL)
    injection.logged_until_s = 1.0


def _gateway_killed(rig: Rig, injection: Injection) -> None:
    gateway = _grown_up(rig, "gateway")
    injection.must_reach(pb.HOLD, within_s=GATEWAY_SILENT_S + 0.05)
    injection.begin()
    os.kill(gateway, signal.SIGKILL)
    rig.wait_until(lambda: rig.pid("gateway") != gateway, "another gateway", _REVIVED_S)


def _gateway_stopped(rig: Rig, injection: Injection) -> None:
    gateway = rig.pid("gateway")
    long = injection.random.random() < 0.5
    lost_s = GATEWAY_LOST_S + 0.05
    injection.must_reach(*((pb.IDLE,) if long else (pb.HOLD,)), within_s=lost_s if long else 0.25)
    injection.begin()
    os.kill(gateway, signal.SIGSTOP)
    try:
        rig.wait_until(enough(lost_s + 0.2 if long else 0.5), "the gateway's sleep")
    finally:
        os.kill(gateway, signal.SIGCONT)
    rig.wait_for_mode(*((pb.READY,) if long else (pb.HOLD,)))


def _outsider(name: str, number: int) -> Callable[[Rig, Injection], None]:
    """Recorder or viewer: the arm goes on as if nothing were."""

    def inject(rig: Rig, injection: Injection) -> None:
        pid = _grown_up(rig, name)
        injection.begin()
        os.kill(pid, number)
        if number == signal.SIGSTOP:
            rig.wait_until(enough(injection.random.uniform(0.3, 1.5)), "its sleep")
            os.kill(pid, signal.SIGCONT)
        else:
            rig.wait_until(lambda: rig.pid(name) != pid, f"another {name}", _REVIVED_S)
        injection.must_go_on()

    return inject


#: So long does a process sleep: around every timeout that somebody has for it, and in between.
_STALLS_S = {
    "device": (0.02, 0.6),
    "control": (0.01, 0.25),
    "gateway": (0.1, 2.5),
    "recorder": (0.1, 3.0),
    "viewer": (0.1, 3.0),
    "supervisor": (0.05, 1.5),
}


def _stalled(name: str) -> Callable[[Rig, Injection], None]:
    """A process sleeps and goes on: nothing may come back in a step, at the device or elsewhere."""

    def inject(rig: Rig, injection: Injection) -> None:
        process = rig.daemon.process
        assert process is not None
        pid = process.pid if name == "supervisor" else rig.pid(name)
        stall_s = injection.random.uniform(*_STALLS_S[name])
        injection.begin()
        os.kill(pid, signal.SIGSTOP)
        time.sleep(stall_s)
        with contextlib.suppress(ProcessLookupError):  # killed meanwhile
            os.kill(pid, signal.SIGCONT)
        time.sleep(0.5)
        if name == "control" and (stall_s > _CONTROL_LOST_S or not rig.alive):
            with contextlib.suppress(pytest.fail.Exception):
                rig.wait_until(lambda: not rig.alive or None, "the end", 3.0)
            if not rig.alive:
                rig.wait_for_end(injection, 3)
                return
        rig.wait_until(lambda: rig.mode is not None, "an answer")
        if name in ("recorder", "viewer", "supervisor"):
            injection.must_go_on()
        else:
            injection.must_stay(*_STALLED_MODES)

    return inject


_CONTROL_LOST_S = 0.09
_STALLED_MODES = (pb.ACTIVE, pb.HOLD, pb.FAULT, pb.IDLE, pb.READY)

_CPX = "festo-cpx"
_STALLS = {
    "device": "goes on, or fault and zeros, latched",
    "control": "goes on, or fault and zeros, or zeroed by the supervisor",
    "gateway": "goes on, holds, or vents after 2 s",
}
_ENDS = "zeroed by the supervisor, which ends the daemon with status 3"
_GOES_ON = "goes on, and nothing is missing in the log"

FAULTS = (
    Fault("control killed", _ENDS, _control(signal.SIGKILL), device=_CPX),
    Fault("control stopped", _ENDS, _control(signal.SIGSTOP), device=_CPX),
    Fault("supervisor killed", "control vents, all end", _supervisor_killed, device=_CPX),
    Fault(
        "supervisor and control killed",
        "zeroed by the device process or by the terminal's watchdog",
        _supervisor_and_control_killed,
        device=_CPX,
    ),
    Fault(
        "all killed at once",
        "zeroed by the terminal's watchdog; the log is readable to 1 s before",
        _all_killed,
        device=_CPX,
    ),
    Fault("device killed", "fault, zeroed by the supervisor", _device(signal.SIGKILL), device=_CPX),
    Fault("device stopped", "fault, zeroed", _device(signal.SIGSTOP), device=_CPX),
    Fault("supervisor stopped", "goes on; the network stops it", _supervisor_stopped),
    Fault("gateway killed", "holds within 200 ms", _gateway_killed),
    Fault("gateway stopped", "holds within 200 ms, vents after 2 s", _gateway_stopped),
    Fault("recorder killed", _GOES_ON, _outsider("recorder", signal.SIGKILL)),
    Fault("recorder stopped", _GOES_ON, _outsider("recorder", signal.SIGSTOP)),
    Fault("viewer killed", _GOES_ON, _outsider("viewer", signal.SIGKILL), _VIEWED),
    Fault("viewer stopped", _GOES_ON, _outsider("viewer", signal.SIGSTOP), _VIEWED),
    *(
        Fault(
            f"{name} stalls, {1e3 * least_s:.0f} to {1e3 * most_s:.0f} ms",
            _STALLS.get(name, _GOES_ON),
            _stalled(name),
            _VIEWED if name == "viewer" else {},
            _CPX,
        )
        for name, (least_s, most_s) in _STALLS_S.items()
    ),
)

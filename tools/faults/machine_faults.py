"""The machine fails the daemon: no room on the disk, another wall clock, no processor."""

import os
import resource
import subprocess
import sys
import time

from pneuarm.logs.schema import pneuarm_pb2 as pb
from tools.faults.clock import CLOCK, Clock
from tools.faults.fault import Fault
from tools.faults.injection import Injection
from tools.faults.rig import TABLES, Rig
from tools.rig.daemon import enough

_VENTS_S = TABLES["log"]["full_disk_vent_s"]
_CORES = sorted(os.sched_getaffinity(0))


def _disk_full(rig: Rig, injection: Injection) -> None:
    """No file of the recorder may grow: this limit stands for a small disk, which needs a mount."""
    recorder = rig.pid("recorder")
    before = resource.prlimit(recorder, resource.RLIMIT_FSIZE)
    size = rig.daemon.log().parts[-1].stat().st_size
    injection.must_reach(pb.HOLD, within_s=1.0)
    injection.begin()
    resource.prlimit(recorder, resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        rig.wait_for_mode(pb.HOLD)
        rig.wait_for_mode(pb.IDLE, pb.READY, patience_s=_VENTS_S + 3.0)
    finally:
        resource.prlimit(recorder, resource.RLIMIT_FSIZE, before)
    rig.wait_until(lambda: rig.watcher.enable().accepted, "enabling with room again")
    rig.watcher.vent()


def _clock_set(rig: Rig, injection: Injection) -> None:
    """The wall clock jumps, back or forth, by seconds or by years."""
    clock = Clock(os.environ[CLOCK])
    jump_s = injection.random.choice((-1, 1)) * 10 ** injection.random.uniform(0, 8)
    injection.begin()
    clock.set(jump_s)
    rig.wait_until(enough(0.8), "ticks under another time")
    injection.must_go_on()
    clock.set(0.0)


_BUSY = "import os, sys; os.sched_setaffinity(0, {int(sys.argv[1])})\nwhile True: pass"


def _busy(rig: Rig, injection: Injection) -> None:
    """Four programs on every core that do nothing but count."""
    injection.begin()
    crowd = [
        subprocess.Popen([sys.executable, "-c", _BUSY, str(core)])
        for core in _CORES
        for _ in range(4)
    ]
    try:
        time.sleep(1.5)
        injection.must_stay(pb.ACTIVE, pb.HOLD)
        stopped_s = time.monotonic()
        rig.watcher.estop(timeout_s=5.0)
        injection.figures["stop_ms"] = 1e3 * (time.monotonic() - stopped_s)
    finally:
        for process in crowd:
            process.kill()
        for process in crowd:
            process.wait(10)
    rig.watcher.reset()


_SEIZE = """
import os, sys, time
os.sched_setaffinity(0, {int(sys.argv[1])})
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(95))
print(flush=True)
begin, length = map(float, sys.stdin.readline().split())
while time.monotonic() < begin: time.sleep(0.0005)
while time.monotonic() < begin + length: pass
"""


def _seized(rig: Rig, injection: Injection) -> None:
    """Nobody but a program at a higher real-time priority runs, on any core."""
    robbers = [
        subprocess.Popen(
            [sys.executable, "-c", _SEIZE, str(core)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        for core in _CORES
    ]
    length_s = injection.random.uniform(0.02, 0.3)
    injection.figures["seized_ms"] = 1e3 * length_s
    try:
        for robber in robbers:
            assert robber.stdout is not None
            robber.stdout.readline()
        begin_s = time.monotonic() + 0.05
        injection.begin_ns = round(begin_s * 1e9)
        for robber in robbers:
            assert robber.stdin is not None
            robber.stdin.write(f"{begin_s} {length_s}\n".encode())
            robber.stdin.flush()
    finally:
        for robber in robbers:
            robber.communicate(timeout=20)
    rig.wait_until(enough(0.5), "what follows")
    if not rig.alive or rig.ending():
        rig.wait_for_end(injection, 3)
        injection.expect_event("control_lost")
    else:
        injection.must_stay(pb.ACTIVE, pb.HOLD)


def _no_realtime() -> str:
    script = "import os; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(95))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, check=False)
    return "" if done.returncode == 0 else "needs real-time rights"


FAULTS = (
    Fault("disk full", "holds, then vents; nothing is missing", _disk_full),
    Fault("wall clock set", "goes on; the log's time runs on", _clock_set, clock=True),
    Fault("processor busy", "goes on or holds; the stop acts", _busy),
    Fault(
        "processor seized, 20 to 300 ms",
        "goes on, holds, or is vented by the supervisor",
        _seized,
        unable=_no_realtime,
    ),
)

"""What the kernel lets this user's processes do: real-time priority and locked memory."""

import os
import resource
from pathlib import Path

from pneuarm.service.doctor.finding import Finding, Verdict
from pneuarm.service.processes.user import user_name

_CAP_IPC_LOCK, _CAP_SYS_NICE = 14, 23
_LIMITS = "/etc/security/limits.d/99-pneuarm.conf"


def in_container(root: Path = Path("/")) -> bool:
    """Whether this looks like a container, where limits are set from outside."""
    return any((root / name).exists() for name in (".dockerenv", "run/.containerenv"))


def has_capability(number: int, status: str) -> bool:
    """Whether ``/proc/self/status`` names a capability as effective."""
    found = [line for line in status.splitlines() if line.startswith("CapEff:")]
    return bool(found) and bool(int(found[0].split()[1], 16) >> number & 1)


def _status() -> str:
    return Path("/proc/self/status").read_text()


def _remedy(line: str, option: str) -> str:
    if in_container():
        return f"start the container with: {option}"
    user = user_name()
    return f"echo '{user} - {line}' | sudo tee -a {_LIMITS}   # then log out and in again"


def priority(wanted: int) -> Finding:
    """Take the loop's real-time priority for a moment, and give it back."""
    name = "real-time priority"
    limit, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
    before, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(wanted))
    except OSError:
        return _refused(name, wanted, limit)
    os.sched_setscheduler(0, before, parameters)
    by = "CAP_SYS_NICE" if has_capability(_CAP_SYS_NICE, _status()) else f"rtprio limit {limit}"
    return Finding(name, Verdict.OK, f"SCHED_FIFO {wanted} granted ({by})")


def _refused(name: str, wanted: int, limit: int) -> Finding:
    text = f"SCHED_FIFO {wanted} refused (rtprio limit {limit}): other programs will delay the loop"
    if limit >= wanted:  # a kernel that shares real-time among control groups gives ours none
        remedy = "sudo sysctl -w kernel.sched_rt_runtime_us=-1"
    else:
        remedy = _remedy("rtprio 98", "--ulimit rtprio=98 --cap-add SYS_NICE")
    return Finding(name, Verdict.WARNING, text, remedy)


def memory() -> Finding:
    """Look at how much memory may be locked: control locks all that it has mapped."""
    name = "locked memory"
    limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if limit == resource.RLIM_INFINITY:
        return Finding(name, Verdict.OK, "no limit")
    if has_capability(_CAP_IPC_LOCK, _status()):
        return Finding(name, Verdict.OK, "no limit (CAP_IPC_LOCK)")
    text = f"limited to {limit // 1024} KiB: pages of the loop may be swapped out, and stall it"
    remedy = _remedy("memlock unlimited", "--ulimit memlock=-1")
    return Finding(name, Verdict.WARNING, text, remedy)

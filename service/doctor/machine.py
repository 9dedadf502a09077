"""Processor, kernel and clocks. ``root`` is where /sys and /proc are looked for."""

import os
import time
from pathlib import Path

from pneuarm.service.doctor.finding import Finding, Verdict

_ROOT = Path("/")
_GOOD_CLOCKS = ("tsc", "kvm-clock", "arch_sys_counter", "hyperv_clocksource_tsc_page")


def _read(path: Path) -> str:
    """Text of a file of the kernel's, empty where there is none."""
    try:
        return path.read_text().strip()
    except OSError:
        return ""


def cores(root: Path = _ROOT) -> Finding:
    """Count the cores for us, and see who else is at work on them."""
    name, number = "cores", len(os.sched_getaffinity(0))
    load = float(_read(root / "proc/loadavg").partition(" ")[0] or 0.0)
    text, values = f"{number}, load {load:.2f}", {"cores": float(number), "load": load}
    quota, _, period = _read(root / "sys/fs/cgroup/cpu.max").partition(" ")
    if quota.isdecimal() and period.isdecimal():
        share = int(quota) / int(period)
        text += f"; limited to {share:g} of them, and stopped when that is used up"
        remedy = "raise CPUQuota= of the service, or start the container without --cpus"
        return Finding(name, Verdict.WARNING, text, remedy, values)
    if number == 1:
        text += ": whatever else runs delays the loop"
        return Finding(name, Verdict.WARNING, text, "use a PC with two cores or more", values)
    if load > number:
        text += ": other programs want more than there is"
        return Finding(name, Verdict.WARNING, text, "see who it is: top -o %CPU", values)
    return Finding(name, Verdict.OK, text, values=values)


def governor(root: Path = _ROOT) -> Finding:
    """See whether the cores are let to slow down between ticks."""
    name = "frequency governor"
    files = (root / "sys/devices/system/cpu").glob("cpu[0-9]*/cpufreq/scaling_governor")
    found = sorted({_read(file) for file in files} - {""})
    if not found:
        return Finding(name, Verdict.INFO, "not known here (a virtual machine, or set by firmware)")
    if found == ["performance"]:
        return Finding(name, Verdict.OK, "performance")
    return Finding(
        name,
        Verdict.WARNING,
        f"{', '.join(found)}: the cores slow down while the loop sleeps, and wake late",
        "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor",
    )


def kernel(root: Path = _ROOT) -> Finding:
    """Name the kernel's kind of preemption."""
    name, system = "kernel", os.uname()
    if _read(root / "sys/kernel/realtime") == "1" or "PREEMPT_RT" in system.version:
        return Finding(name, Verdict.OK, f"{system.release}, PREEMPT_RT")
    kind = next((word for word in system.version.split() if word.startswith("PREEMPT")), "")
    text = f"{system.release}, {kind or 'no full preemption'}; a kernel with PREEMPT_RT has the "
    return Finding(name, Verdict.INFO, text + "shorter worst cases")


def clock_source(root: Path = _ROOT) -> Finding:
    """See what the kernel counts time with: a slow source makes every reading slow."""
    name = "clock source"
    found = _read(root / "sys/devices/system/clocksource/clocksource0/current_clocksource")
    resolution_ns = time.clock_getres(time.CLOCK_MONOTONIC) * 1e9
    if resolution_ns > 1000.0:
        text = f"timers of {resolution_ns * 1e-6:g} ms: too coarse for the loop"
        return Finding(name, Verdict.FAILED, text, "boot without highres=off")
    if not found:
        return Finding(name, Verdict.INFO, f"not known here, resolution {resolution_ns:g} ns")
    if found in _GOOD_CLOCKS:
        return Finding(name, Verdict.OK, f"{found}, resolution {resolution_ns:g} ns")
    return Finding(
        name,
        Verdict.WARNING,
        f"{found}: reading it takes microseconds",
        "boot with clocksource=tsc, and see why it was dropped: dmesg | grep -i tsc",
    )

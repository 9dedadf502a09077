"""How late this PC wakes the loop, and whether its wall clock runs evenly."""

import ctypes
import time

import numpy as np

from pneuarm.service.configuration.tables.control import ControlConfig
from pneuarm.service.control.clock import Clock
from pneuarm.service.doctor.finding import Finding, Verdict
from pneuarm.service.doctor.rights import in_container
from pneuarm.service.processes import realtime

_STATUS_OFFSET = 40  # of `status` in struct timex, on 64 bits
_STA_UNSYNC = 0x40

#: The wall clock may be slewed by 0.05 %; more within a second is a step.
_STEP_S = 5e-3


def wake_up(control: ControlConfig, seconds: float = 1.0) -> Finding:
    """Sleep as the loop does, for a second, at its priority where that is granted."""
    name = "wake-up latency"
    clock = Clock(control.rate_hz, control.spin_us)
    number = max(2, int(seconds * control.rate_hz))
    granted = realtime.take_priority(control.priority)
    try:
        wakes = [clock.wait() for _ in range(number)]
    finally:
        if granted:
            realtime.drop_priority()
    late_us = np.array([wake.late_ns for wake in wakes]) * 1e-3
    p50, p99, largest = np.percentile(late_us, [50, 99, 100])
    skipped = sum(wake.skipped for wake in wakes)
    period_us = 1e6 / control.rate_hz
    text = (
        f"p50 {p50:.1f} us, p99 {p99:.1f} us, max {largest:.0f} us of a period of {period_us:g} us"
        f"{'' if granted else ', without priority'}"
    )
    if skipped:
        text += f"; {skipped} of {number + skipped} cycles missed"
    values = {"p50_us": p50, "p99_us": p99, "max_us": largest, "skipped": float(skipped)}
    values = {key: float(value) for key, value in values.items()}
    if p99 >= 0.5 * period_us:
        remedy = "end other programs, mend the warnings above, or lower control.rate_hz"
        return Finding(name, Verdict.FAILED, text, remedy, values)
    if skipped or largest >= period_us:
        remedy = "mend the warnings above; if there are none, run it again on the idle PC"
        return Finding(name, Verdict.WARNING, text, remedy, values)
    return Finding(name, Verdict.OK, text, values=values)


def wall_clock(seconds: float = 0.2) -> Finding:
    """Compare the wall clock with the monotonic one; sessions are named and stamped by it."""
    name = "wall clock"
    start_s, start_unix_s = time.monotonic(), time.time()
    time.sleep(seconds)
    gained_s = (time.time() - start_unix_s) - (time.monotonic() - start_s)
    if abs(gained_s) > _STEP_S:
        text = f"moved by {1e3 * gained_s:+.0f} ms within {seconds:g} s: something sets it"
        remedy = "one service is to keep the time: timedatectl set-ntp true"
        return Finding(name, Verdict.WARNING, text, remedy)
    if time.gmtime(start_unix_s).tm_year < 2024:
        text = f"says {time.strftime('%Y-%m-%d', time.gmtime(start_unix_s))}: it was never set"
        return Finding(name, Verdict.WARNING, text, "sudo timedatectl set-ntp true")
    synchronised = _synchronised()
    if synchronised is None:
        return Finding(name, Verdict.INFO, "runs evenly; whether by NTP is not known here")
    if synchronised:
        return Finding(name, Verdict.OK, "runs evenly, synchronised")
    if in_container():
        return Finding(name, Verdict.INFO, "runs evenly, not synchronised; the host sets it")
    text = "runs evenly, not synchronised: times in the logs are this PC's own"
    return Finding(name, Verdict.INFO, text, "sudo timedatectl set-ntp true")


def _synchronised() -> bool | None:
    """Ask the kernel whether a time service disciplines its clock; None where it does not say."""
    buffer = ctypes.create_string_buffer(512)
    if ctypes.sizeof(ctypes.c_long) != 8 or ctypes.CDLL(None).adjtimex(buffer) < 0:
        return None
    status = int.from_bytes(buffer.raw[_STATUS_OFFSET : _STATUS_OFFSET + 4], "little")
    return not status & _STA_UNSYNC

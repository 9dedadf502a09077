"""What a device's own record says: nothing but what is allowed has reached it, and the air went."""

from itertools import pairwise
from pathlib import Path

import numpy as np

from pneuarm.controllers.arm.arm import Arm
from tools.faults.emulator import EMPTY_PA, Record, read_record
from tools.faults.injection import Injection

#: A terminal takes whole millibars, and the guard believes it to have taken the fraction too.
_QUANTUM_PA = 300.0


def audit_device(path: Path, arm: Arm, injections: list[Injection], jitter_s: float = 0.0) -> None:
    """Judge every injection by what reached the device in its time.

    ``jitter_s``: a device that acknowledges nothing may note a setpoint so much too late.
    """
    record = read_record(path)
    begin_ns = 0
    for index, injection in enumerate(injections):
        last = index == len(injections) - 1
        end_ns = np.iinfo(np.int64).max if last else injection.end_ns
        inside = (record.time_ns >= begin_ns) & (record.time_ns < end_ns)
        injection.check("the device was written to", bool(inside.any()))
        if inside.any():
            rows = np.flatnonzero(inside)
            _check_setpoints(
                record, np.arange(max(0, rows[0] - 1), rows[-1] + 1), arm, injection, jitter_s
            )
        if injection.zero_within_s is not None:
            _check_zero(record, injection)
        begin_ns = end_ns


def _check_setpoints(
    record: Record, rows: np.ndarray, arm: Arm, injection: Injection, jitter_s: float
) -> None:
    sent = record.setpoints_pa[rows]
    low = arm.per_chamber("pressure_min_pa").reshape(-1)
    high = arm.per_chamber("pressure_max_pa").reshape(-1)
    slew = arm.per_chamber("pressure_slew_max_pa_s").reshape(-1)
    injection.check(
        "setpoints inside their limits",
        bool(((sent >= low) & (sent <= high)).all()),
        f"{sent.min():.0f} to {sent.max():.0f} Pa",
    )
    time_s = (record.time_ns[rows] - record.time_ns[rows[0]]) * 1e-9
    excess_pa = _above_slew(sent, time_s, slew) - slew * jitter_s - _QUANTUM_PA
    worst_pa = excess_pa.max()
    injection.check("slew at the device", worst_pa <= 0.0, f"above it by {worst_pa:.0f} Pa")


def _above_slew(sent_pa: np.ndarray, time_s: np.ndarray, slew_pa_s: np.ndarray) -> np.ndarray:
    """How far each chamber (chambers,) got ahead of its slew, between any two setpoints, Pa.

    Venting is exempt: every row of zeros begins anew.
    """
    begins = [0, *np.flatnonzero((sent_pa == 0.0).all(axis=1)), len(sent_pa)]
    allowed_pa = slew_pa_s * time_s[:, None]
    found = np.zeros(sent_pa.shape[1])
    for begin, end in pairwise(begins):
        for sign in (1.0, -1.0):
            ahead = sign * sent_pa[begin:end] - allowed_pa[begin:end]
            lowest = np.minimum.accumulate(ahead, axis=0)
            found = np.maximum(found, (ahead - lowest).max(axis=0, initial=0.0))
    return found


def _check_zero(record: Record, injection: Injection) -> None:
    """All setpoints zero in time, and when the chambers were empty."""
    begin_ns, limit_s = injection.begin_ns, injection.zero_within_s
    assert limit_s is not None
    zero = (record.setpoints_pa == 0.0).all(axis=1)
    before = np.flatnonzero(record.time_ns <= begin_ns)
    after = np.flatnonzero((record.time_ns > begin_ns) & zero)
    if len(before) and zero[before[-1]]:
        injection.check("the arm had air in it", False)
        return
    injection.check("the device is zeroed", len(after) > 0)
    if not len(after):
        return
    at = after[0]
    injection.safe_s = float(record.time_ns[at] - begin_ns) * 1e-9
    injection.figures["zeroed_by_the_watchdog_times"] = float(record.why[at] == "watchdog")
    injection.check(
        "zero in time",
        injection.safe_s <= limit_s,
        f"{1e3 * injection.safe_s:.0f} ms instead of {1e3 * limit_s:.0f} ms",
    )
    empty = (np.abs(record.true_pa) < EMPTY_PA).all(axis=1)
    emptied = np.flatnonzero((record.sampled_ns > record.time_ns[at]) & empty)
    injection.check("the chambers are empty", len(emptied) > 0)
    if len(emptied):
        injection.empty_s = float(record.sampled_ns[emptied[0]] - begin_ns) * 1e-9

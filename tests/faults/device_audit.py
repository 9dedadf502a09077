"""What a device's own record says: nothing but what is allowed has reached it, and the air went."""

from pathlib import Path

import numpy as np

from controllers.arm import Arm
from tests.faults.emulator import EMPTY_PA, Record, read_record
from tests.faults.fault import Injection

#: A terminal takes whole millibars, and the guard believes it to have taken the fraction too.
_QUANTUM_PA = 300.0


def audit_device(path: Path, arm: Arm, injections: list[Injection]) -> None:
    """Judge every injection by what reached the device in its time."""
    record = read_record(path)
    begin_ns = 0
    for index, injection in enumerate(injections):
        last = index == len(injections) - 1
        end_ns = np.iinfo(np.int64).max if last else injection.end_ns
        inside = (record.time_ns >= begin_ns) & (record.time_ns < end_ns)
        injection.check("the device was written to", bool(inside.any()))
        if inside.any():
            rows = np.flatnonzero(inside)
            _check_setpoints(record, np.arange(max(0, rows[0] - 1), rows[-1] + 1), arm, injection)
        if injection.zero_within_s is not None:
            _check_zero(record, injection)
        begin_ns = end_ns


def _check_setpoints(record: Record, rows: np.ndarray, arm: Arm, injection: Injection) -> None:
    sent = record.setpoints_pa[rows]
    low = arm.per_chamber("pressure_min_pa").reshape(-1)
    high = arm.per_chamber("pressure_max_pa").reshape(-1)
    slew = arm.per_chamber("pressure_slew_max_pa_s").reshape(-1)
    injection.check(
        "setpoints inside their limits",
        bool(((sent >= low) & (sent <= high)).all()),
        f"{sent.min():.0f} to {sent.max():.0f} Pa",
    )
    steps = np.abs(np.diff(sent, axis=0))
    elapsed_s = np.diff(record.time_ns[rows])[:, None] * 1e-9
    too_fast = (steps > slew * elapsed_s + _QUANTUM_PA).any(axis=1) & (sent[1:] != 0.0).any(axis=1)
    excess_pa = (steps - slew * elapsed_s)[too_fast].max(initial=0.0)
    injection.check(
        "slew at the device", not too_fast.any(), f"{too_fast.sum()} steps, by {excess_pa:.0f} Pa"
    )


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

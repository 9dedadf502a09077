"""What a session's log says of the invariants, over every tick of it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import PneuarmError
from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import EVENT, STATE, TARGET
from tools.faults.injection import Injection

#: Of a monotonic time in seconds, times the slew.
_ROUNDING_PA = 1e-3


@dataclass
class Session:
    """A log as arrays; times on the monotonic clock, ns. Shapes (ticks,) and (ticks, chambers)."""

    sequence: np.ndarray
    time_ns: np.ndarray
    mode: np.ndarray
    sent_pa: np.ndarray
    lengths_m: np.ndarray
    events: list[pb.Event]
    targets: list[tuple[int, pb.Target]]
    offset_ns: int

    def event(self, code: str, after_ns: int) -> pb.Event | None:
        """First event of a code at or after a monotonic time."""
        after_ns += self.offset_ns
        later = (e for e in self.events if e.code == code and e.time_unix_ns >= after_ns)
        return next(later, None)


def read_session(path: Path, offset_ns: int) -> Session:
    """Read a log, broken off or not; raises LogError if it is none."""
    rows, events, targets = [], [], []
    for entry in LogReader(path):
        message = entry.message
        if entry.topic is STATE and isinstance(message, pb.ArmState):
            sent, lengths = list(message.pressure_sent_pa), list(message.length_commanded_m)
            rows.append((message.sequence, message.time_unix_ns, message.mode, sent, lengths))
        elif entry.topic is EVENT and isinstance(message, pb.Event):
            events.append(message)
        elif entry.topic is TARGET and isinstance(message, pb.Target):
            targets.append((entry.time_unix_ns - offset_ns, message))
    rows.sort(key=lambda row: row[0])
    n = max((len(row[3]) for row in rows), default=3)
    return Session(
        sequence=np.array([row[0] for row in rows], dtype=np.int64),
        time_ns=np.array([row[1] for row in rows], dtype=np.int64) - offset_ns,
        mode=np.array([row[2] for row in rows], dtype=np.int64),
        sent_pa=np.array([row[3] or [np.nan] * n for row in rows], dtype=np.float64),
        lengths_m=np.array([row[4] or [np.nan] * n for row in rows], dtype=np.float64),
        events=sorted(events, key=lambda event: event.time_unix_ns),
        targets=targets,
        offset_ns=offset_ns,
    )


def audit_log(
    path: Path, offset_ns: int, arm: Arm, injections: list[Injection], device: bool
) -> None:
    """Judge every injection by the log of its session; the windows together cover all of it.

    ``device`` says that the pressures are judged by a device's own record instead.
    """
    try:
        session = read_session(path, offset_ns)
    except PneuarmError as error:
        for injection in injections:
            injection.check("the log is readable", False, str(error))
        return
    begin_ns = 0
    for index, injection in enumerate(injections):
        last = index == len(injections) - 1
        end_ns = np.iinfo(np.int64).max if last else injection.end_ns
        inside = (session.time_ns >= begin_ns) & (session.time_ns < end_ns)
        injection.check("the log is readable", bool(inside.any()), "no tick of this time in it")
        if inside.any():
            # One tick more at the beginning, so that no step between two windows goes unseen.
            rows = np.arange(max(0, np.flatnonzero(inside)[0] - 1), np.flatnonzero(inside)[-1] + 1)
            if not device:
                _check_pressures(session, rows, arm, injection)
            _audit(session, rows, arm, injection)
        begin_ns = end_ns


def _audit(session: Session, rows: np.ndarray, arm: Arm, injection: Injection) -> None:
    _check_ticks(session, rows, injection)
    low = arm.per_chamber("length_min_m").reshape(-1)
    high = arm.per_chamber("length_max_m").reshape(-1)
    lengths = session.lengths_m[rows]
    lengths = lengths[np.isfinite(lengths).all(axis=1)]
    injection.check(
        "lengths inside Eq. (4)",
        bool(((lengths > low) & (lengths < high)).all()),
        f"{lengths.min() if len(lengths) else 0} to {lengths.max() if len(lengths) else 0} m",
    )
    _check_end(session, injection)
    _check_modes(session, rows, injection)


def _check_ticks(session: Session, rows: np.ndarray, injection: Injection) -> None:
    steps = np.diff(session.sequence[rows])
    injection.check(
        "every tick is in the log", bool((steps == 1).all()), f"{int((steps - 1).sum())} missing"
    )
    injection.check(
        "the log's time never runs backwards", bool((np.diff(session.time_ns[rows]) > 0).all())
    )


def _check_pressures(session: Session, rows: np.ndarray, arm: Arm, injection: Injection) -> None:
    """Range and slew of what was sent; what could not be sent is not a number, in a fault only."""
    sent, mode = session.sent_pa[rows], session.mode[rows]
    low = arm.per_chamber("pressure_min_pa").reshape(-1)
    high = arm.per_chamber("pressure_max_pa").reshape(-1)
    slew = arm.per_chamber("pressure_slew_max_pa_s").reshape(-1)
    unknown = ~np.isfinite(sent).all(axis=1)
    injection.check("what was sent is known", bool(np.isin(mode[unknown], (pb.FAULT,)).all()))
    known = sent[~unknown]
    injection.check("pressures inside their limits", bool(((known >= low) & (known <= high)).all()))
    elapsed_s = np.diff(session.time_ns[rows][~unknown]) * 1e-9
    steps = np.abs(np.diff(known, axis=0))
    largest = slew * elapsed_s[:, None] + _ROUNDING_PA
    vented = (known[1:] == 0.0).all(axis=1)
    too_fast = (steps > largest).any(axis=1) & ~vented
    injection.check(
        "slew",
        not too_fast.any(),
        f"{int(too_fast.sum())} steps, the largest {steps[too_fast].max(initial=0.0):.0f} Pa",
    )


def _check_end(session: Session, injection: Injection) -> None:
    """What only one of the faults asks for: an event, the age of the last target, a killed log."""
    if injection.event:
        event = session.event(injection.event, injection.begin_ns)
        injection.check(f"the event {injection.event}", event is not None)
        if event is not None:
            at_ns = event.time_unix_ns - session.offset_ns
            if injection.zero_within_s is None:
                injection.safe_s = (at_ns - injection.begin_ns) * 1e-9
    if injection.logged_until_s is not None:
        lacks_s = (injection.begin_ns - session.time_ns.max()) * 1e-9
        limit_s = injection.logged_until_s
        injection.check("the log's end", lacks_s <= limit_s, f"lacks {lacks_s:.2f} s")
    if injection.only_targets_of:
        window = range(injection.begin_ns, injection.until_ns)
        senders = {message.client_id for time_ns, message in session.targets if time_ns in window}
        others = [s for s in senders if not s.startswith(injection.only_targets_of)]
        injection.check("no command accepted", bool(senders) and not others, str(others))
    if injection.held_after_s is not None:
        _check_hold(session, injection, injection.held_after_s)


def _check_hold(session: Session, injection: Injection, timeout_s: float) -> None:
    """Invariant 3: hold at the first tick at which the last target is older than the timeout."""
    holds = np.flatnonzero((session.time_ns >= injection.begin_ns) & (session.mode == pb.HOLD))
    if not len(holds):
        return  # told already: the safe state was not reached
    at_ns, before_ns = session.time_ns[holds[0]], session.time_ns[holds[0] - 1]
    received = [time_ns for time_ns, _ in session.targets if time_ns <= at_ns]
    due_ns = max(received, default=0) + timeout_s * 1e9
    late_ms = 1e-6 * (at_ns - due_ns)
    injection.check(
        "hold within the timeout and one tick", before_ns <= due_ns, f"{late_ms:.1f} ms late"
    )


def _check_modes(session: Session, rows: np.ndarray, injection: Injection) -> None:
    time_ns, mode = session.time_ns[rows], session.mode[rows]
    after = time_ns >= injection.begin_ns
    if injection.allowed:
        during = mode[after & (time_ns <= injection.until_ns)]
        others = sorted({pb.Mode.Name(m) for m in during.tolist() if m not in injection.allowed})
        what = "the arm goes on" if injection.allowed == {pb.ACTIVE} else "no other mode"
        injection.check(what, len(during) > 0 and not others, ", ".join(others))
    if injection.safe:
        found = np.flatnonzero(after & np.isin(mode, tuple(injection.safe)))
        injection.check("the safe state is reached", len(found) > 0)
        if len(found):
            injection.safe_s = float(time_ns[found[0]] - injection.begin_ns) * 1e-9
    if injection.safe_s is not None and injection.within_s is not None:
        injection.check(
            "in time",
            injection.safe_s <= injection.within_s,
            f"{1e3 * injection.safe_s:.1f} ms instead of {1e3 * injection.within_s:.0f} ms",
        )

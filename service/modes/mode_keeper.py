"""Keeps the mode: applies events to the table, watches the timers, tells what happened."""

from collections.abc import Callable
from dataclasses import dataclass

from pneuarm.logs.rings.status import Disk
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.modes.mode import Mode, ModeEvent, next_mode, why_not

#: A gateway that is silent for this long means hold, and for that long vent: nobody could stop
#: the arm over the network.
GATEWAY_SILENT_S = 0.2
GATEWAY_LOST_S = 2.0


@dataclass(frozen=True)
class Timeouts:
    """How long (s) things may last."""

    target_s: float
    arming_s: float
    hold_s: float
    full_disk_vent_s: float


@dataclass(frozen=True)
class Notice:
    """What an event tells: one word for programs, sentences for people."""

    level: "pb.Level"
    code: str
    text: str
    cause: str = ""
    remedy: str = ""


@dataclass(slots=True)  # made in every tick: freezing it would cost more than all of its use
class Conditions:
    """What the keeper looks at once a tick. Ages in seconds; None means there is none."""

    target_age_s: float | None
    gateway_age_s: float
    operator: bool
    disk: Disk
    pressure_near_zero: bool


_TEXTS: dict[ModeEvent, tuple[str, str, str]] = {
    ModeEvent.VENTED: ("the arm is ready", "connected, and every pressure is near zero", ""),
    ModeEvent.ENABLE: ("the arm is active", "enabled by its operator", ""),
    ModeEvent.HOLD: ("the arm holds", "asked to", ""),
    ModeEvent.VENT: ("the arm vents", "asked to", ""),
    ModeEvent.RESET: ("reset; the arm is idle", "asked to", ""),
    ModeEvent.ESTOP: ("emergency stop: the arm vents", "asked to", "reset, then enable"),
    ModeEvent.TARGET_STALE: (
        "the arm holds",
        "no fresh target arrived in time",
        "send targets more often than the timeout, then enable again",
    ),
    ModeEvent.LEASE_LOST: (
        "the arm holds",
        "its operator is gone, or another took over",
        "take the lease and enable again",
    ),
    ModeEvent.LEASE_RELEASED: ("the arm holds", "its operator gave the lease back", ""),
    ModeEvent.HOLD_TIMEOUT: ("the arm vents", "it held too long without an operator", ""),
    ModeEvent.GATEWAY_SILENT: (
        "the arm holds",
        "the gateway is silent: nobody could stop the arm over the network",
        "it is started again by itself; then enable again",
    ),
    ModeEvent.GATEWAY_LOST: ("the arm vents", "the gateway stays silent", "start the daemon again"),
    ModeEvent.DISK_FULL: (
        "the arm holds",
        "the disk takes no more of the log",
        "free some space in the sessions' directory; nothing is lost for 30 s",
    ),
    ModeEvent.FAULT_HOLD: ("the arm holds", "a fault", "remove the cause, then enable again"),
    ModeEvent.DISK_STILL_FULL: ("the arm vents", "the disk is still full", "free some space"),
}

_WARNINGS = frozenset(
    {
        ModeEvent.TARGET_STALE,
        ModeEvent.LEASE_LOST,
        ModeEvent.GATEWAY_SILENT,
        ModeEvent.GATEWAY_LOST,
        ModeEvent.DISK_FULL,
        ModeEvent.DISK_STILL_FULL,
        ModeEvent.FAULT_HOLD,
        ModeEvent.ESTOP,
    }
)


class ModeKeeper:
    """The mode, and the rules by which time alone changes it."""

    def __init__(self, timeouts: Timeouts, emit: Callable[[pb.Event], None]) -> None:
        self.mode = Mode.IDLE
        self._timeouts = timeouts
        self._emit = emit
        self._entered_s = self._operator_s = self._not_full_s = 0.0
        self._disk = Disk.STARTING

    def request(self, event: ModeEvent, now_s: float, client: str, blocked: str = "") -> str:
        """Apply what somebody asked for; return why not, or an empty string.

        ``blocked`` says what forbids it although the mode would allow it.
        """
        reason = ""
        if next_mode(self.mode, event) is None:
            reason = why_not(self.mode, event)
            if blocked and event == ModeEvent.ENABLE:
                reason += f"; {blocked}"
        elif blocked:
            reason = blocked
        elif event == ModeEvent.ENABLE and self._disk in (Disk.LOW, Disk.FULL):
            reason = (
                "too little free space to record the session; free some in the sessions' "
                "directory, or lower log.min_free_mib"
            )
        if reason:
            self.tell(Notice(pb.WARNING, "mode_refused", reason), client)
        else:
            self.apply(event, now_s, client)
        return reason

    def apply(
        self,
        event: ModeEvent,
        now_s: float,
        client: str = "",
        cause: str = "",
        notice: Notice | None = None,
    ) -> bool:
        """Apply an event if it means anything now; return whether it did.

        A change is told by ``notice``, without one by what is usual for the event; so is a hold
        that is asked for while the arm holds.
        """
        after = next_mode(self.mode, event)
        if after is None:
            return False
        changed = after != self.mode
        self.mode = after
        if changed:
            self._entered_s = now_s
        # Who asks for a hold of an arm that holds already means that nobody else shall go on.
        if changed or event == ModeEvent.HOLD:
            self.tell(notice or _usual_notice(event, cause), client)
        return True

    def watch(self, now_s: float, now: Conditions) -> None:
        """Let time and the other processes change the mode; in order of urgency."""
        self._disk = now.disk
        if now.operator:
            self._operator_s = now_s
        if now.disk != Disk.FULL:
            self._not_full_s = now_s
        in_mode_s = now_s - self._entered_s
        recording = now.disk != Disk.STARTING  # nothing moves before it is recorded
        if self.mode in (Mode.ACTIVE, Mode.HOLD):
            if now.gateway_age_s > GATEWAY_LOST_S:
                self.apply(ModeEvent.GATEWAY_LOST, now_s)
            elif now.gateway_age_s > GATEWAY_SILENT_S:
                self.apply(ModeEvent.GATEWAY_SILENT, now_s)
        if self.mode == Mode.ACTIVE:
            self._watch_active(now_s, in_mode_s, now)
        elif self.mode == Mode.HOLD:
            self._watch_hold(now_s)
        elif self.mode == Mode.IDLE and now.pressure_near_zero and recording:
            self.apply(ModeEvent.VENTED, now_s)

    def _watch_active(self, now_s: float, in_mode_s: float, now: Conditions) -> None:
        if now.disk == Disk.FULL:
            self.apply(ModeEvent.DISK_FULL, now_s)
        elif now.target_age_s is None:
            if in_mode_s > self._timeouts.arming_s:
                self.apply(ModeEvent.TARGET_STALE, now_s)
        elif now.target_age_s > self._timeouts.target_s:
            self.apply(ModeEvent.TARGET_STALE, now_s)

    def _watch_hold(self, now_s: float) -> None:
        full_s = now_s - self._not_full_s
        alone_s = now_s - max(self._entered_s, self._operator_s)
        if full_s > self._timeouts.full_disk_vent_s:
            self.apply(ModeEvent.DISK_STILL_FULL, now_s)
        elif alone_s > self._timeouts.hold_s:
            self.apply(ModeEvent.HOLD_TIMEOUT, now_s)

    def tell(self, notice: Notice, client: str = "") -> None:
        """Emit an event; whoever emits it puts the time on it."""
        self._emit(
            pb.Event(
                level=notice.level,
                source="control",
                code=notice.code,
                text=notice.text,
                cause=notice.cause,
                remedy=notice.remedy,
                client_id=client,
                mode=pb.Mode.Name(self.mode),
            )
        )


def _usual_notice(event: ModeEvent, cause: str) -> Notice:
    text, usual_cause, remedy = _TEXTS.get(event, ("fault: the arm vents", "", "reset"))
    level = pb.WARNING if event in _WARNINGS else pb.INFO
    level = pb.ERROR if event == ModeEvent.FAULT else level
    return Notice(level, event.name.lower(), text, cause or usual_cause, remedy)

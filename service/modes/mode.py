"""The mode machine: a pure table of mode and event.

    idle --vented--> ready --enable--> active --(a)--> hold
      ^                                  | ^             |
      |                                  | +--- enable --+
      +----------------(b)---------------+---------------+

    (a) HOLD, TARGET_STALE, LEASE_LOST, LEASE_RELEASED, GATEWAY_SILENT, DISK_FULL, FAULT_HOLD
    (b) VENT, HOLD_TIMEOUT, GATEWAY_LOST, DISK_STILL_FULL

    fault and estop come from every mode, are latched, and are left only by reset, to idle.

idle, ready, fault and estop are vented; active and hold keep air in the arm.
"""

from enum import IntEnum


class Mode(IntEnum):
    """The modes, numbered as on the wire."""

    IDLE = 1
    READY = 2
    ACTIVE = 3
    HOLD = 4
    FAULT = 5
    ESTOP = 6


class ModeEvent(IntEnum):
    """What can happen to a mode; ``cause`` says what brings it about."""

    cause: str

    def __new__(cls, number: int, cause: str) -> "ModeEvent":
        """Make an event of its number and its cause."""
        event = int.__new__(cls, number)
        event._value_ = number
        event.cause = cause
        return event

    VENTED = 1, "every measured pressure below 20 mbar, and the recorder runs"
    ENABLE = 2, "lease holder"
    HOLD = 3, "anybody"
    VENT = 4, "anybody, or the end of the daemon"
    RESET = 5, "anybody"
    ESTOP = 6, "anybody"
    FAULT = 7, "a fault that ramps or vents, see docs/safety.md#faults"
    TARGET_STALE = 8, "no target for `target_timeout_ms`, none at all for `arming_timeout_s`"
    LEASE_LOST = 9, "holder gone, or taken over"
    HOLD_TIMEOUT = 10, "no operator for `hold_timeout_s`"
    GATEWAY_SILENT = 11, "no heartbeat for 200 ms"
    GATEWAY_LOST = 12, "no heartbeat for 2 s"
    DISK_FULL = 13, "the disk takes nothing"
    DISK_STILL_FULL = 14, "for `full_disk_vent_s`"
    LEASE_RELEASED = 15, "holder gave it back after following a target"
    FAULT_HOLD = 16, "a fault that holds, see docs/safety.md#faults"


#: Modes without air in the arm: nothing but zeros is sent to the device, in fault after the ramp.
VENTED_MODES = frozenset({Mode.IDLE, Mode.READY, Mode.FAULT, Mode.ESTOP})

_HOLDS = (
    ModeEvent.HOLD,
    ModeEvent.TARGET_STALE,
    ModeEvent.LEASE_LOST,
    ModeEvent.LEASE_RELEASED,
    ModeEvent.GATEWAY_SILENT,
    ModeEvent.DISK_FULL,
    ModeEvent.FAULT_HOLD,
)
_VENTS = (
    ModeEvent.VENT,
    ModeEvent.HOLD_TIMEOUT,
    ModeEvent.GATEWAY_LOST,
    ModeEvent.DISK_STILL_FULL,
)

TABLE: dict[tuple[Mode, ModeEvent], Mode] = {
    (Mode.IDLE, ModeEvent.VENTED): Mode.READY,
    (Mode.READY, ModeEvent.ENABLE): Mode.ACTIVE,
    (Mode.HOLD, ModeEvent.ENABLE): Mode.ACTIVE,
    (Mode.IDLE, ModeEvent.VENT): Mode.IDLE,
    (Mode.READY, ModeEvent.VENT): Mode.READY,
    (Mode.FAULT, ModeEvent.RESET): Mode.IDLE,
    (Mode.ESTOP, ModeEvent.RESET): Mode.IDLE,
    (Mode.HOLD, ModeEvent.HOLD): Mode.HOLD,
    **{(Mode.ACTIVE, event): Mode.HOLD for event in _HOLDS},
    **{(Mode.ACTIVE, event): Mode.IDLE for event in _VENTS},
    **{(Mode.HOLD, event): Mode.IDLE for event in _VENTS},
    **{(mode, ModeEvent.ESTOP): Mode.ESTOP for mode in Mode},
    **{(mode, ModeEvent.FAULT): Mode.FAULT for mode in Mode if mode != Mode.ESTOP},
}

_WHY_NOT: dict[tuple[Mode, ModeEvent], str] = {
    (
        Mode.IDLE,
        ModeEvent.ENABLE,
    ): "the chambers are still venting, or the recorder has not started; try again when ready",
    (Mode.ACTIVE, ModeEvent.ENABLE): "the arm is active already",
    (Mode.FAULT, ModeEvent.ENABLE): "a fault is latched; remove its cause and reset first",
    (Mode.ESTOP, ModeEvent.ENABLE): "the emergency stop is latched; reset first",
    (Mode.IDLE, ModeEvent.HOLD): "the arm is vented: there is nothing to hold",
    (Mode.READY, ModeEvent.HOLD): "the arm is vented: there is nothing to hold",
    (Mode.FAULT, ModeEvent.HOLD): "the arm is vented: there is nothing to hold",
    (Mode.ESTOP, ModeEvent.HOLD): "the arm is vented: there is nothing to hold",
    (Mode.FAULT, ModeEvent.VENT): "the air goes already, and the fault stays until reset",
    (Mode.ESTOP, ModeEvent.VENT): "the arm is vented already, and the stop stays until reset",
}


def next_mode(mode: Mode, event: ModeEvent) -> Mode | None:
    """Return the mode after an event, or None where the event is not allowed or means nothing."""
    return TABLE.get((mode, event))


def why_not(mode: Mode, event: ModeEvent) -> str:
    """Say why an event is not allowed, for the person who asked for it."""
    reason = _WHY_NOT.get((mode, event))
    if reason is None:
        reason = f"{event.name.lower()} means nothing now"
    return f"mode is {mode.name.lower()}: {reason}"

"""The mode machine: a pure table of mode and event.

    idle --vented--> ready --enable--> active <--enable-- hold
      ^                                  |  hold, stale target, lease lost, gateway silent  ^
      |                                  +---------------------------------------------------+
      +-- vent, hold timeout, gateway lost, disk full -- active, hold
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
    """What can happen to a mode."""

    VENTED = 1  # connected, and the measured pressure is near zero
    ENABLE = 2
    HOLD = 3
    VENT = 4
    RESET = 5
    ESTOP = 6
    FAULT = 7
    TARGET_STALE = 8
    LEASE_LOST = 9
    HOLD_TIMEOUT = 10
    GATEWAY_SILENT = 11
    GATEWAY_LOST = 12
    DISK_FULL = 13
    DISK_STILL_FULL = 14
    LEASE_RELEASED = 15
    FAULT_HOLD = 16  # a fault whose policy is to hold


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

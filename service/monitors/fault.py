"""A fault: its code, its bit, what it usually comes from, what the arm does, and the remedy."""

from dataclasses import dataclass
from enum import IntEnum

from pneuarm.service.modes.mode import ModeEvent


class Policy(IntEnum):
    """What the arm does about a fault, the mildest first: its event, and its words."""

    event: ModeEvent | None
    consequence: str

    def __new__(cls, number: int, event: ModeEvent | None, consequence: str) -> "Policy":
        """Make a policy of its number, the event that it brings about, and the consequence."""
        policy = int.__new__(cls, number)
        policy._value_ = number
        policy.event, policy.consequence = event, consequence
        return policy

    WARN = 0, None, "the arm goes on"
    HOLD = (
        1,
        ModeEvent.FAULT_HOLD,
        "the arm holds, and enabling is refused until the cause is gone",
    )
    RAMP = (
        2,
        ModeEvent.FAULT,
        "the pressures ramp to zero, and the fault stays until reset",
    )
    VENT = 3, ModeEvent.FAULT, "the arm vents at once, and the fault stays until reset"
    STOP = 4, ModeEvent.ESTOP, "the arm vents at once, and the stop stays until reset"


@dataclass(frozen=True, eq=False)  # there is one of each, and it is its own key
class Fault:
    """One row of the table of docs/safety.md; ``cause`` is what it usually comes from.

    ``bit`` counts from 0 in ``ArmState.active_faults``, ``code`` is that of the event. Both stand
    in recorded sessions: they are never given to another fault.
    """

    code: str
    bit: int
    policy: Policy
    cause: str
    remedy: str

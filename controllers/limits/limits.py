"""The limits on where the chambers of an arm may be: the list that everything goes through.

A new limit is a file, a line in KINDS, and the field of the arm that says how far it lets go.
"""

from collections.abc import Iterator

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.limits.bend import BendLimit
from pneuarm.controllers.limits.keep_out import KeepOutLimit
from pneuarm.controllers.limits.length import LengthLimit
from pneuarm.controllers.limits.limit import Limit
from pneuarm.controllers.limits.pressure import PressureLimit

#: Every kind of limit; lengths are clipped to them in this order.
KINDS: tuple[type[Limit], ...] = (LengthLimit, PressureLimit, BendLimit, KeepOutLimit)


class Limits:
    """The limits of one arm."""

    def __init__(self, arm: Arm) -> None:
        self._every = tuple(kind(arm) for kind in KINDS if kind.applies_to(arm))

    def __iter__(self) -> Iterator[Limit]:
        """Go through them, in the order of KINDS."""
        return iter(self._every)

    def clip(self, lengths_m: Array) -> Array:
        """Lengths (n_sections, 3) near the given ones that respect what can be clipped to."""
        for limit in self._every:
            lengths_m = limit.clip(lengths_m)
        return lengths_m

    def binding(self, lengths_m: Array) -> int:
        """Bits of the limits that lengths (n_sections, 3) are at."""
        return sum(limit.bit for limit in self._every if limit.stops(lengths_m))


def names(bits: int) -> tuple[str, ...]:
    """Names of the limits whose bits are set."""
    return tuple(kind.name for kind in KINDS if kind.bit & bits)


def words(bits: int) -> str:
    """Name the limits whose bits are set for people; "" where none is."""
    return " and ".join(kind.words or kind.name for kind in KINDS if kind.bit & bits)


def workspace_is_exact(arm: Arm) -> bool:
    """Whether the workspace of an arm is known exactly, with every limit, for its own tip."""
    return (
        arm.n_sections == 1
        and not any(arm.tool_m)
        and all(kind.in_workspace for kind in KINDS if kind.applies_to(arm))
    )


def refuse_contradictions(arm: Arm) -> None:
    """Raise InvalidInput, in one sentence, where the limits exclude each other or the arm at rest.

    The vented arm is straight and at its rest lengths: it must be inside every limit, since it is
    there that every session begins and ends.
    """
    for limit in Limits(arm):
        said = limit.contradiction()
        if said:
            raise InvalidInput(said)

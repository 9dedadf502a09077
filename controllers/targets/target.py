"""What a kind of target tells of itself: how it is made of a message, and what it asks the law for.

A new kind is a message in the .proto, a file here with a line in
:data:`pneuarm.controllers.targets.targets.KINDS`, and what makes the message for the client.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import ClassVar, Self

import casadi as ca

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.targets.checks import Allowed, Fields
from pneuarm.controllers.tasks.rows import Block, Parts
from pneuarm.controllers.tasks.wanted import Wanted


class LawName(IntEnum):
    """The laws, numbered as on the wire."""

    DEFAULT = 0
    RESOLVED_RATE = 1
    QP_IK = 2


class Target(ABC):
    """One thing that can be asked for, frozen, in SI units and the base frame."""

    #: Its field in the message ``pneuarm.Target``, and its ``TargetKind`` in the state.
    name: ClassVar[str]
    kind: ClassVar[int]
    #: The law where neither the target nor the configuration says one; None: the configured.
    default_law: ClassVar[LawName | None] = None
    #: Whether there is something to reach.
    has_end: ClassVar[bool] = True
    #: Whether pressures are asked for as they are, past what undoes lag and hysteresis.
    sends_pressures: ClassVar[bool] = False
    #: Whether it says enough without others.
    alone: ClassVar[bool] = True
    #: Parameters of its own in what is wanted, name and size, for its :meth:`rows`.
    parts: ClassVar[Mapping[str, int]] = {}

    law: LawName

    @classmethod
    @abstractmethod
    def checked(cls, fields: Fields, allowed: Allowed, law: LawName) -> Self:
        """Make it of a message's fields; raises TargetRejected: what, and what is allowed."""

    @abstractmethod
    def write(self, wanted: Wanted) -> None:
        """Write down the task: what is wanted of the tip and the chambers; leave the rest alone."""

    @classmethod
    def rows(cls, arm: Arm, lengths: ca.SX, want: Parts) -> Block | None:
        """Rows of its own, beside those of the tip and the chambers, over ``lengths``."""
        return None

    def ask(self, wanted: Wanted, gain_per_s: float, speed_max_m_s: float) -> None:
        """Ask for this and nothing else, with errors worked off at a gain and up to a speed."""
        wanted.forget(gain_per_s, speed_max_m_s)
        self.write(wanted)

    def weighted(self, weight: float, orientation_weight: float) -> "Target":
        """Return it with a weight beside other tasks, where it may be one of several."""
        raise NotImplementedError

    def sets(self) -> frozenset[str]:
        """What it alone decides: two tasks that set the same contradict each other."""
        return frozenset({self.name})

    def in_lengths(self, lengths_of: Callable[[Array], Array]) -> "Target":
        """Return what the law is given; ``lengths_of`` pressures (n_sections, 3) is the map."""
        return self

    def goal(self) -> tuple[Array | None, Array | None]:
        """Position (3,) and quaternion (4,) of the tip that are wanted in the end, where known."""
        return None, None

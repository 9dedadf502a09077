"""What a fault is, and what one injection of it has shown."""

import random
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pneuarm.logs.schema import pneuarm_pb2 as pb

if TYPE_CHECKING:
    from tools.faults.rig import Rig


@dataclass
class Injection:
    """One injection: when, what was checked, and how long the arm took to its safe state.

    Times are monotonic, ns. ``safe`` are the modes that count as safe, or ``event`` names the event
    that tells of it; ``allowed`` are those in which the arm may be until ``until_ns``.
    ``held_after_s`` is the target's timeout where the arm has to hold for want of targets,
    ``logged_until_s`` how much of its end the log may lack, ``only_targets_of`` whose targets
    alone may have been accepted. ``zero_within_s`` is the time in which the
    device has to be zeroed, by its own record.
    """

    fault: str
    seed: int
    random: random.Random
    begin_ns: int = 0
    until_ns: int = 0
    end_ns: int = 0
    safe: frozenset[int] = frozenset()
    allowed: frozenset[int] = frozenset()
    safe_s: float | None = None
    empty_s: float | None = None
    within_s: float | None = None
    event: str = ""
    held_after_s: float | None = None
    logged_until_s: float | None = None
    only_targets_of: str = ""
    zero_within_s: float | None = None
    kept: int = 0
    broken: list[str] = field(default_factory=list)
    figures: dict[str, float] = field(default_factory=dict)

    def begin(self) -> None:
        """The fault happens now."""
        self.begin_ns = time.monotonic_ns()

    def end(self) -> None:
        """Everything that follows from it is over."""
        self.end_ns = time.monotonic_ns()

    def check(self, invariant: str, kept: bool, detail: str = "") -> None:
        """Count an invariant as kept or broken."""
        if kept:
            self.kept += 1
        else:
            self.broken.append(f"{invariant}: {detail}" if detail else invariant)

    def must_reach(self, *modes: int, within_s: float | None = None) -> None:
        """The arm has to reach one of these modes, in time; the log is asked afterwards."""
        self.safe, self.within_s = frozenset(modes), within_s

    def expect_event(self, code: str) -> None:
        """The arm's safe state is what this event of the log tells of."""
        self.event = code

    def must_go_on(self) -> None:
        """The arm has to have stayed active from the beginning until now."""
        self.must_stay(pb.ACTIVE)

    def must_stay(self, *modes: int) -> None:
        """The arm has to have been in one of these modes from the beginning until now."""
        self.allowed, self.until_ns = frozenset(modes), time.monotonic_ns()

    @property
    def checks(self) -> int:
        """Number of invariants that were looked at."""
        return self.kept + len(self.broken)


@dataclass(frozen=True)
class Fault:
    """One kind of fault; ``inject`` lets it happen, waits for what follows, and heals it.

    ``policy`` is what the arm does, for the table. ``clock`` says that it sets the daemon's wall
    clock, ``unable`` why it cannot be injected on this machine, or nothing.
    """

    name: str
    policy: str
    inject: "Callable[[Rig, Injection], None]"
    tables: dict[str, dict[str, Any]] = field(default_factory=dict)
    device: str = "simulator"
    clock: bool = False
    unable: Callable[[], str] = lambda: ""


@dataclass
class Row:
    """All injections of one fault."""

    fault: Fault
    injections: list[Injection] = field(default_factory=list)
    unable: str = ""

    @property
    def times_s(self) -> list[float]:
        """Times to the safe state, s."""
        return sorted(i.safe_s for i in self.injections if i.safe_s is not None)

    @property
    def empty_s(self) -> list[float]:
        """Times until the chambers behind an emulated device were empty, s."""
        return [i.empty_s for i in self.injections if i.empty_s is not None]

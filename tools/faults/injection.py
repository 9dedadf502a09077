"""One injection of a fault: when it was, and what it has shown."""

import random
import time
from dataclasses import dataclass, field

from pneuarm.logs.schema import pneuarm_pb2 as pb


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

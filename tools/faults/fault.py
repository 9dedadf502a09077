"""What a fault is, and the row of its injections."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from tools.faults.injection import Injection
from tools.faults.rig import Rig


@dataclass(frozen=True)
class Fault:
    """One kind of fault; ``inject`` lets it happen, waits for what follows, and heals it.

    ``policy`` is what the arm does, for the table. ``clock`` says that it sets the daemon's wall
    clock, ``unable`` why it cannot be injected on this machine, or nothing.
    """

    name: str
    policy: str
    inject: Callable[[Rig, Injection], None]
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

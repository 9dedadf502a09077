"""What a monitor is, what it looks at, and how long something must last to count."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.tables.table import Table
from pneuarm.service.modes.mode import Mode
from pneuarm.service.monitors.fault import Fault

MS, PERCENT = 1e-3, 0.01

#: For how long something must be so without a break to count.
Lasting = Annotated[
    float, Field(ge=0, le=10000, description="for how long without a break, to be a fault")
]


@dataclass(slots=True)  # made in every tick: freezing it would cost more than all of its use
class Observation:
    """One tick as the monitors see it: SI units, chambers in lists row by row, NaN is unknown.

    ``sent_pa`` is what the valves were told in the tick before, ``expected_pa`` what should have
    come of it by now. ``tip_error_m`` is the distance of the measured tip from the estimated one.
    """

    now_s: float
    dt_s: float
    mode: Mode
    vented: bool
    measured_pa: list[float]
    sent_pa: list[float]
    expected_pa: list[float]
    age_s: float
    supply_pa: float
    setpoints_pa: list[float] | None
    lengths_m: list[float]
    estimated_m: list[float]
    tip_error_m: float
    overruns: int
    complaints: tuple[str, ...]
    stop_pressed: bool


class Monitor(ABC):
    """Looks for one fault. A kind of monitor is a subclass, and a line in the list of them.

    ``looks_at`` and ``how_to_set`` are its row in docs/safety.md. ``keys`` are those of the table
    ``[monitors.CODE]`` of a configuration, with CODE that of the fault; without keys there is none.
    One that ``needs_fresh`` compares a measurement with the present: it looks at no old one.
    """

    fault: ClassVar[Fault]
    looks_at: ClassVar[str]
    how_to_set: ClassVar[str]
    keys: ClassVar[type[Table]] = Table
    needs_fresh: ClassVar[bool] = True

    def __init__(self, arm: Arm, keys: Any) -> None:  # noqa: B027 - some need neither
        """Prepare to look at ``arm``; ``keys`` is an instance of the class of that name."""

    @abstractmethod
    def look(self, seen: Observation) -> str:
        """Return what is wrong in words, or an empty string. Called once a tick."""


class Persistence:
    """Whether something has been so without a break for longer than a time."""

    def __init__(self) -> None:
        self._since_s: float | None = None

    def longer(self, so: bool, now_s: float, than_s: float) -> bool:
        """Take one look at ``now_s``."""
        if not so:
            self._since_s = None
            return False
        if self._since_s is None:
            self._since_s = now_s
        return now_s - self._since_s > than_s


def chamber(index: int) -> str:
    """Name of a chamber for people: sections from the base on, both counted from 1."""
    return f"section {index // 3 + 1}, chamber {index % 3 + 1}"


def bar(pressure_pa: float) -> str:
    """Format a pressure for people."""
    return f"{pressure_pa * 1e-5:.3f} bar"

"""What the contract suite knows of every device: how to open one, and what stands behind it.

A new adapter is tested by one entry in :data:`DEVICES`: a context manager that takes an arm and
yields a :class:`Bench`.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field

import numpy as np

from controllers.arm import Arm, Array
from hardware.interface import Hardware
from hardware.simulator.adapter import SimulatedArm
from hardware.simulator.parameters import SimulatorParameters
from service.config import load

#: With vacuum, and without.
ARMS = {name: load(None, name).build_arm() for name in ("paper", "table1")}


class SimulatedClock:
    """Time that passes only when it is told to, for devices that live in simulated time."""

    def __init__(self) -> None:
        self.now_s = 10.0

    def pass_s(self, seconds: float) -> None:
        self.now_s += seconds


class RealClock:
    """Time as it is, for devices behind a real transport."""

    @property
    def now_s(self) -> float:
        return time.monotonic()

    @staticmethod
    def pass_s(seconds: float) -> None:
        time.sleep(seconds)


@dataclass
class Bench:
    """One device on the bench: its adapter, not yet connected, and hands on the device itself.

    ``told_pa`` returns the pressures (n_sections, 3) that the device regulates to now, seen from
    the device's side; it is None where there is no such side. ``resolution_pa`` is the smallest
    step of a command on the transport, 0 where it takes any number. ``period_s`` is how long the
    device needs between two calls. ``unplug`` takes the device away so that it falls silent or
    its transport breaks, ``plug`` brings it back, at rest; both None where it cannot go.
    ``timeout_s`` is the time within which the adapter must say that it is gone. ``abandon`` lets
    the adapter's end of the transport drop as if the host had died; ``watchdog_s`` is when the
    device's own watchdog has then run out.
    """

    arm: Arm
    hardware: Hardware
    told_pa: Callable[[], Array] | None = None
    resolution_pa: float = 0.0
    period_s: float = 0.01
    unplug: Callable[[], None] | None = None
    plug: Callable[[], None] | None = None
    timeout_s: float = 1.0
    abandon: Callable[[], None] | None = None
    watchdog_s: float = 0.5
    clock: SimulatedClock | RealClock = field(default_factory=SimulatedClock)

    @property
    def low_pa(self) -> Array:
        return self.arm.per_chamber("pressure_min_pa")

    @property
    def high_pa(self) -> Array:
        return self.arm.per_chamber("pressure_max_pa")

    def some_pa(self) -> Array:
        """A command well inside the arm's limits, no two chambers alike, on no round number."""
        shares = np.linspace(0.21, 0.67, self.arm.n_chambers).reshape(-1, 3)
        return self.low_pa + shares * (self.high_pa - self.low_pa) + 3.7

    def connect(self) -> Hardware:
        """Connect, and read once: the first reading sets the clock of a simulated device."""
        self.hardware.connect()
        self.hardware.read(self.now_s())
        return self.hardware

    def now_s(self) -> float:
        """Let the device's period pass, and say what time it is."""
        self.clock.pass_s(self.period_s)
        return self.clock.now_s


Factory = Callable[[Arm], AbstractContextManager[Bench]]


@contextmanager
def simulator(arm: Arm) -> Iterator[Bench]:
    """The simulated arm; what it was told is what its pressures settle at."""
    hardware = SimulatedArm(arm, SimulatorParameters(), 0)
    bench = Bench(arm, hardware, period_s=1e-3)

    def told_pa() -> Array:
        bench.clock.pass_s(1.0)
        readings = [hardware.read(bench.now_s()).pressures_pa for _ in range(50)]
        return np.mean(readings, axis=0)

    bench.told_pa = told_pa
    yield bench


#: Every adapter by its name in `[hardware] adapter`.
DEVICES: dict[str, Factory] = {
    "simulator": simulator,
}

#: How far ``told_pa`` may be from what was sent, in Pa: the simulator has real valves.
TOLD_TOLERANCE_PA = {"simulator": 2000.0}

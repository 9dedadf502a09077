"""What the contract suite knows of every device: how to open one, and what stands behind it.

A new adapter is tested by one entry in :data:`DEVICES`: a context manager that takes an arm and
yields a :class:`Bench`.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.hardware.channels import Channels
from pneuarm.hardware.ctrl_p.adapter import CtrlP, CtrlPSettings
from pneuarm.hardware.ctrl_p.emulator import CtrlPEmulator
from pneuarm.hardware.ctrl_p.protocol import STEP_PA as CTRL_P_STEP_PA
from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.esp32.adapter import Esp32, Esp32Settings
from pneuarm.hardware.esp32.emulator import Esp32Emulator
from pneuarm.hardware.esp32.protocol import PASS_S as ESP32_PASS_S
from pneuarm.hardware.esp32.protocol import STEP_PA as ESP32_STEP_PA
from pneuarm.hardware.interface import Hardware
from pneuarm.hardware.simulator.adapter import SimulatedArm
from pneuarm.hardware.simulator.parameters import SimulatorParameters
from pneuarm.hardware.transports.pseudo_terminal import PseudoTerminal
from pneuarm.logs.reading.replay_device import ReplayDevice
from pneuarm.service.configuration.configuration import load
from tests.hardware.example_adapter import ValveBox
from tests.hardware.example_device import ValveBoxDevice
from tests.logs.reading.test_replay_device import record

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


@contextmanager
def ctrl_p(arm: Arm) -> Iterator[Bench]:
    """A Ctrl-P controller with eight channels, wired from the last one down."""
    valves = tuple(range(7, 7 - arm.n_chambers, -1))
    emulated = EmulatedArm(arm, 0)
    emulator = CtrlPEmulator(emulated, Channels(arm, 8, valves, "valves"))
    with PseudoTerminal(emulator) as terminal:
        settings = CtrlPSettings(str(terminal.path), valves, telemetry_s=0.01)
        hardware = CtrlP(arm, settings)
        yield serial_bench(arm, hardware, emulated, terminal, CTRL_P_STEP_PA)


@contextmanager
def esp32(arm: Arm) -> Iterator[Bench]:
    """An ESP32 controller; the arm has the range of pressures that it can give."""
    low_pressure = replace(
        arm.sections[0], pressure_min_pa=0.0, pressure_max_pa=1.2e4, pressure_slew_max_pa_s=1e5
    )
    arm = replace(arm, sections=(low_pressure,))
    valves, potentiometers = (2, 0, 1), ((3, 6), (1, 4), (2, 5))
    emulated = EmulatedArm(arm, 0)
    emulator = Esp32Emulator(emulated, Channels(arm, 3, valves, "valves"))
    with PseudoTerminal(emulator) as terminal:
        settings = Esp32Settings(str(terminal.path), valves, potentiometers, connect_timeout_s=1.0)
        bench = serial_bench(arm, Esp32(arm, settings), emulated, terminal, ESP32_STEP_PA)
        bench.period_s = ESP32_PASS_S
        yield bench


@contextmanager
def replay(arm: Arm) -> Iterator[Bench]:
    """A recorded session of the arm, 60 s long."""
    with TemporaryDirectory() as folder:
        yield Bench(arm, ReplayDevice(arm, record(Path(folder) / "log.mcap", arm, 6000)))


@contextmanager
def example(arm: Arm) -> Iterator[Bench]:
    """The adapter of docs/hardware.md, to copy from; 1 mbar a step, a watchdog of 200 ms."""
    with ValveBoxDevice(EmulatedArm(arm, 0)) as device:
        yield Bench(
            arm,
            ValveBox(arm, "127.0.0.1", device.port),
            device.told_pa,
            resolution_pa=100.0,
            unplug=device.unplug,
            plug=device.plug,
            abandon=lambda: None,
            clock=RealClock(),
        )


def serial_bench(
    arm: Arm,
    hardware: Hardware,
    emulated: EmulatedArm,
    terminal: PseudoTerminal,
    resolution_pa: float,
) -> Bench:
    """Put a serial device on the bench; what it does with a command takes it some passes."""

    def told_pa() -> Array:
        time.sleep(0.05)
        with terminal.lock:
            return emulated.setpoints_pa.copy()

    return Bench(
        arm,
        hardware,
        told_pa,
        resolution_pa,
        unplug=terminal.unplug,
        plug=terminal.plug,
        abandon=lambda: None,  # a host that hangs sends nothing more
        clock=RealClock(),
    )


#: Every adapter by its name in `[hardware] adapter`.
DEVICES: dict[str, Factory] = {
    "simulator": simulator,
    "ctrl-p": ctrl_p,
    "esp32": esp32,
    "replay": replay,
    "example": example,
}

#: How far ``told_pa`` may be from what was sent, in Pa: the simulator has real valves.
TOLD_TOLERANCE_PA = {"simulator": 2000.0}

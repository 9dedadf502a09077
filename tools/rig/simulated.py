"""The control loop on simulated time: no clock, no sleeping, every write to the device seen."""

from argparse import ArgumentParser
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.targets.targets import Target
from pneuarm.hardware.interface import Hardware, Measurement
from pneuarm.hardware.simulator.device import DEVICE as SIMULATOR
from pneuarm.hardware.simulator.device import SimulatedDevice
from pneuarm.hardware.simulator.parameters import Valves
from pneuarm.logs.rings.status import Disk
from pneuarm.logs.rings.tick import tick_dtype
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.configuration import Configuration, load
from pneuarm.service.configuration.devices import devices
from pneuarm.service.control.loop import Loop, LoopSettings, Timing
from pneuarm.service.devices import registry as backends
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.modes.mode_keeper import Timeouts
from pneuarm.service.processes.pipe import (
    Command,
    Heartbeat,
    ModeReply,
    RequestMode,
    SetTarget,
    SetTipPose,
)

START_UNIX_NS = 1_800_000_000_000_000_000
START_NS = 5_000_000_000

TIMEOUTS = Timeouts(target_s=0.2, arming_s=3.0, hold_s=2.0, full_disk_vent_s=0.5)


@dataclass
class Watched:
    """A device whose every call is written down, and that fails when told to."""

    device: Hardware
    writes: list[tuple[float, Array]] = field(default_factory=list)
    vents: list[float] = field(default_factory=list)
    fail_read: Exception | None = None
    fail_write: Exception | None = None
    fail_vent: Exception | None = None

    def connect(self) -> None:
        self.device.connect()

    def read(self, time_s: float) -> Measurement:
        if self.fail_read is not None:
            raise self.fail_read
        return self.device.read(time_s)

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        if self.fail_write is not None:
            raise self.fail_write
        self.writes.append((time_s, pressures_pa.copy()))
        return self.device.write(pressures_pa, time_s)

    def vent(self, time_s: float) -> None:
        if self.fail_vent is not None:
            raise self.fail_vent
        self.vents.append(time_s)
        self.device.vent(time_s)

    def close(self) -> None:
        self.device.close()


def configuration_of(
    preset: str = "paper",
    rate_hz: float = 500.0,
    seed: int = 0,
    valves: Valves = "servo",
    world: str = SIMULATOR.name,
) -> Configuration:
    """A built-in arm at a rate, simulated in a world: the name of a device that simulates."""
    whole = load(preset=preset)
    device = devices().named(world)
    own = whole.of_device(device).model_copy(update={"seed": seed, "valves": valves})
    tables = {
        "control": whole.control.model_copy(update={"rate_hz": rate_hz}),
        "hardware": whole.hardware.model_copy(update={"adapter": world}),
        device.table: own,
    }
    return whole.model_copy(update=tables)


def add_world(parser: ArgumentParser) -> None:
    """Let a command choose the world in which its arms are simulated."""
    worlds = [d.name for d in devices().usable.values() if isinstance(d, SimulatedDevice)]
    parser.add_argument("--world", choices=worlds, default=SIMULATOR.name)


class Bench:
    """One arm and its loop; `tick` is one period. The gateway's heartbeat comes by itself."""

    def __init__(
        self,
        preset: str = "paper",
        rate_hz: float = 500.0,
        seed: int = 0,
        configuration: Configuration | None = None,
        supply_flow_max_bar_s: float = inf,
    ) -> None:
        self.configuration = configuration or configuration_of(preset, rate_hz, seed)
        rate_hz = self.configuration.control.rate_hz
        self.arm = self.configuration.build_arm()
        self.hardware = Watched(backends.build(self.configuration, self.arm))
        self.events: list[pb.Event] = []
        self.period_ns = round(1e9 / rate_hz)
        settings = LoopSettings.of(self.configuration, TIMEOUTS, START_NS, START_UNIX_NS)
        settings = replace(settings, supply_flow_max_pa_s=supply_flow_max_bar_s * 1e5)
        self.hardware.connect()
        self.loop = Loop(self.arm, settings, self.hardware, self.events.append)
        self.now_ns = START_NS
        self.loop.start_at(self.now_ns)
        self.loop.warm_up()
        self.hardware.vents.clear()
        self.hardware.writes.clear()
        self.heartbeat = True
        self.operator = True
        self.disk = Disk.OK
        self.replies: list[ModeReply] = []
        self.records: list[bytes] = []
        self.tip_pose: Callable[[], Array] | None = None  # what motion capture sees now
        self.overruns_per_tick = 0.0
        self._overruns = 0.0
        self._request_id = 0
        self._sequence = 0

    @property
    def now_s(self) -> float:
        return self.now_ns * 1e-9

    @property
    def mode(self) -> Mode:
        return self.loop.mode

    @property
    def newest(self) -> np.void:
        dtype = tick_dtype(self.arm.n_sections)
        tick: np.void = np.frombuffer(self.records[-1], dtype)[0]
        return tick

    def ticks(self) -> np.ndarray:
        return np.frombuffer(b"".join(self.records), tick_dtype(self.arm.n_sections))

    def tick(self, *commands: Command) -> np.void:
        self.now_ns += self.period_ns
        given: list[Command] = [Heartbeat(self.operator)] if self.heartbeat else []
        if self.tip_pose is not None and self.records:
            position = np.array(self.tip_pose())
            given.append(SetTipPose(position, np.array([0.0, 0.0, 0.0, 1.0]), self.now_ns))
        self._overruns += self.overruns_per_tick
        timing = Timing(compute_s=1e-4, overruns=int(self._overruns))
        record, replies = self.loop.tick(self.now_ns, [*given, *commands], self.disk, timing)
        self.records.append(record)
        self.replies += replies
        return self.newest

    def ask(self, event: ModeEvent, client: str = "me") -> ModeReply:
        """One tick with a request in it; the reply."""
        self._request_id += 2
        self.tick(RequestMode(event, self._request_id, client))
        assert self.replies[-1].request_id == self._request_id
        return self.replies[-1]

    def target(self, target: Target, age_s: float = 0.0) -> SetTarget:
        """A target as it comes at the next tick."""
        self._sequence += 1
        received_ns = self.now_ns + self.period_ns - int(age_s * 1e9)
        return SetTarget(target, self._sequence, received_ns)

    def run(self, seconds: float, target: Target | None = None) -> np.void:
        """Go on for some time, refreshing a target every 20 ms."""
        every = max(1, round(0.02e9 / self.period_ns))
        for number in range(round(seconds * 1e9 / self.period_ns)):
            refresh = target is not None and number % every == 0
            self.tick(*((self.target(target),) if refresh and target is not None else ()))
        return self.newest

    def run_until(self, condition: Callable[[], bool], at_most_s: float) -> None:
        """Go on until something is so; fails when it does not come."""
        end_ns = self.now_ns + int(at_most_s * 1e9)
        while not condition():
            assert self.now_ns < end_ns, f"waited {at_most_s:g} s of simulated time in vain"
            self.tick()

    def get_ready(self) -> "Bench":
        self.run_until(lambda: self.mode == Mode.READY, 3.0)
        return self

    def activate(self) -> "Bench":
        self.get_ready()
        assert self.ask(ModeEvent.ENABLE).accepted
        return self

    def codes(self) -> list[str]:
        return [event.code for event in self.events]


def true_tip(tick: np.void) -> Array:
    return np.array(tick["tip_true_position_m"])

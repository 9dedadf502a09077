"""A simulated arm with a simulated camera in the real loop, on simulated time."""

from collections import deque
from collections.abc import Callable

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.geometry.rotations import quaternion_from_rotation
from pneuarm.controllers.targets.targets import CircleTarget, PositionTarget, Target
from pneuarm.hardware.interface import Hardware, Measurement
from pneuarm.logs.rings.status import Disk
from pneuarm.logs.rings.tick import tick_dtype
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.control.loop import Loop, LoopSettings, Timing
from pneuarm.service.devices import registry as backends
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.modes.mode_keeper import Timeouts
from pneuarm.service.processes.pipe import Command, Heartbeat, RequestMode, SetTarget, SetTipPose

_START_NS = 5_000_000_000
_TIMEOUTS = Timeouts(target_s=0.2, arming_s=30.0, hold_s=60.0, full_disk_vent_s=0.5)


class FilmedArm:
    """A simulated arm, whose newest true tip the camera looks at."""

    def __init__(self, device: Hardware) -> None:
        self.device = device
        self.tip: tuple[Array, Array] | None = None

    def connect(self) -> None:
        self.device.connect()

    def read(self, time_s: float) -> Measurement:
        measurement = self.device.read(time_s)
        self.tip = measurement.true_tip
        return measurement

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        return self.device.write(pressures_pa, time_s)

    def vent(self, time_s: float) -> None:
        self.device.vent(time_s)

    def close(self) -> None:
        self.device.close()


class CameraRig:
    """Daemon's loop, arm and camera; one tick is one period of the configuration.

    The camera takes ``camera_hz`` poses a second, which arrive ``delay_s`` later, with
    ``noise_m`` on every axis. ``camera`` switches it. ``device`` stands in the place of the
    configuration's.
    """

    def __init__(
        self,
        configuration: Configuration,
        *,
        camera: bool = True,
        camera_hz: float = 100.0,
        delay_s: float = 0.01,
        noise_m: float = 1e-4,
        device: Hardware | None = None,
    ) -> None:
        self.arm = configuration.build_arm()
        rate_hz = configuration.control.rate_hz
        self.period_ns = round(1e9 / rate_hz)
        self.hardware = FilmedArm(device or backends.build(configuration, self.arm))
        self.events: list[pb.Event] = []
        settings = LoopSettings.of(configuration, _TIMEOUTS, _START_NS, _START_NS)
        self.hardware.connect()
        self.loop = Loop(self.arm, settings, self.hardware, self.events.append)
        self.now_ns = _START_NS
        self.loop.start_at(self.now_ns)
        self.loop.warm_up()
        self.camera = camera
        self._camera_ns, self._next_ns = round(1e9 / camera_hz), self.now_ns
        self._delay_ns, self._noise_m = round(delay_s * 1e9), noise_m
        self._rng = np.random.default_rng([configuration.simulated.seed, 7])
        self._on_the_way: deque[tuple[int, Array, Array]] = deque()
        self._records: list[bytes] = []
        self._target: Target | None = None
        self._sequence = 0
        self.outlier_m = np.zeros(3)
        #: What the camera makes of a position (3,) and a quaternion (4,) at a time (s).
        self.lie: Callable[[Array, Array, float], tuple[Array, Array]] | None = None

    def _look(self) -> None:
        """Take a picture when it is time; called after the device was read."""
        if self.now_ns < self._next_ns or self.hardware.tip is None:
            return
        self._next_ns += self._camera_ns
        position, rotation = self.hardware.tip
        if self.camera:
            noisy = position + self._rng.normal(0.0, self._noise_m, 3) + self.outlier_m
            quaternion = quaternion_from_rotation(rotation)
            if self.lie is not None:
                noisy, quaternion = self.lie(noisy, quaternion, self.now_ns * 1e-9)
            self._on_the_way.append((self.now_ns + self._delay_ns, noisy, quaternion))

    def _arrived(self) -> list[Command]:
        poses: list[Command] = []
        while self._on_the_way and self._on_the_way[0][0] <= self.now_ns:
            at_ns, position, quaternion = self._on_the_way.popleft()
            poses.append(SetTipPose(position, quaternion, at_ns))
        return poses

    def tick(self, *commands: Command) -> None:
        """One period; the target is refreshed every 20 ms."""
        self.now_ns += self.period_ns
        given: list[Command] = [Heartbeat(True), *self._arrived(), *commands]
        if self._target is not None and (self.now_ns // self.period_ns) % 10 == 0:
            self._sequence += 1
            given.append(SetTarget(self._target, self._sequence, self.now_ns))
        record, _ = self.loop.tick(self.now_ns, given, Disk.OK, Timing())
        self._records.append(record)
        self._look()

    def activate(self) -> "CameraRig":
        """Wait for ready, and arm."""
        while self.loop.mode != Mode.READY:
            self.tick()
        self.tick(RequestMode(ModeEvent.ENABLE, 2, "bench"))
        return self

    def rest(self, request: RequestMode, seconds: float) -> np.ndarray:
        """Ask for a mode, and go on without any target; return the ticks."""
        self._target, first = None, len(self._records)
        self.tick(request)
        for _ in range(round(seconds * 1e9 / self.period_ns)):
            self.tick()
        return self.ticks(first)

    def run(self, seconds: float, target: Target | None = None) -> np.ndarray:
        """Go on with a target, or with the one before; return the ticks."""
        self._target = target or self._target
        first = len(self._records)
        for _ in range(round(seconds * 1e9 / self.period_ns)):
            self.tick()
        return self.ticks(first)

    def ticks(self, first: int = 0) -> np.ndarray:
        """Ticks from a number on."""
        dtype = tick_dtype(self.arm.n_sections)
        return np.frombuffer(b"".join(self._records[first:]), dtype)

    def forget(self) -> None:
        """Keep no ticks but those to come."""
        self._records.clear()

    def to(self, position_m: Array, seconds: float) -> np.ndarray:
        """Go to a position."""
        return self.run(seconds, PositionTarget(np.asarray(position_m, dtype=np.float64)))

    def circle(self, shape: CircleTarget, seconds: float) -> np.ndarray:
        """Go round."""
        return self.run(seconds, shape)

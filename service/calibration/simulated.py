"""A calibration of the simulated arm in simulated time: the same plan and fit, in seconds.

The loop runs as fast as it can on time that is only counted. What motion capture would measure is
the true tip with noise.
"""

import sys
import time
from functools import partial

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import CalibrationError
from pneuarm.controllers.calibration.calibrate import calibrate
from pneuarm.controllers.calibration.plan import Move, duration_s, plan
from pneuarm.controllers.calibration.recording import Recording
from pneuarm.controllers.geometry.rotations import rotation_from_quaternion, rotation_from_vector
from pneuarm.controllers.targets.targets import PressuresTarget
from pneuarm.hardware.interface import Hardware
from pneuarm.logs.rings.status import Disk
from pneuarm.logs.rings.tick import tick_dtype
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.calibration.drive import progress
from pneuarm.service.calibration.files import calibrated
from pneuarm.service.calibration.motion import Pacer, first_moves, pace_after
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.control.loop import Loop, LoopSettings, Timing
from pneuarm.service.devices import registry as backends
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.modes.mode_keeper import Timeouts
from pneuarm.service.processes.pipe import Command, Heartbeat, RequestMode, SetTarget

_PERIOD_NS = 4_000_000
_SAMPLE_TICKS = 3
#: Whether a move is over is looked at this often.
_LOOK_TICKS = 25
_SAMPLE_S = 1e-9 * _PERIOD_NS * _SAMPLE_TICKS
_REFRESH_TICKS = 5
_NOISE_M, _NOISE_RAD = 1e-4, 2e-3
_READY_TICKS = 1000
_FOREVER = Timeouts(target_s=1.0, arming_s=1e6, hold_s=1e6, full_disk_vent_s=1e6)


class _Run:
    """The loop of a simulated arm, one tick after another."""

    def __init__(self, configuration: Configuration, device: Hardware) -> None:
        self.arm, self.why = configuration.build_arm(), ""
        device.connect()
        control = configuration.control.model_copy(update={"rate_hz": 1e9 / _PERIOD_NS})
        slower = configuration.model_copy(update={"control": control})
        settings = LoopSettings.of(slower, _FOREVER, 0, time.time_ns())
        self._loop = Loop(self.arm, settings, device, self._keep)
        self._loop.warm_up()
        self._dtype = tick_dtype(self.arm.n_sections)
        self.now_ns = self.ticks = 0

    def _keep(self, event: pb.Event) -> None:
        """Keep what was said last of something wrong."""
        if event.level == pb.ERROR or not self.why:
            self.why = event.text

    def tick(self, *commands: Command) -> np.void:
        self.now_ns += _PERIOD_NS
        self.ticks += 1
        given: list[Command] = [Heartbeat(operator=True), *commands]
        record, _ = self._loop.tick(self.now_ns, given, Disk.OK, Timing())
        newest: np.void = np.frombuffer(record, self._dtype)[0]
        return newest

    def activate(self) -> None:
        """Wait for the vented arm, then arm."""
        for _ in range(_READY_TICKS):
            self.tick()
            if self._loop.mode == Mode.READY:
                break
        self.tick(RequestMode(ModeEvent.ENABLE, 2, "calibration"))

    def follow(self, pressures_pa: Array) -> np.void:
        """One tick toward pressures (n_sections, 3)."""
        if self.ticks % _REFRESH_TICKS:
            return self.tick()
        target = PressuresTarget(pressures_pa)
        return self.tick(SetTarget(target, self.ticks, self.now_ns + _PERIOD_NS))


def calibrate_simulated(configuration: Configuration) -> Configuration:
    """Calibrate the arm that a configuration simulates; return it with the fitted values."""
    recording = record_simulated(configuration)
    return calibrated(configuration, calibrate(configuration.build_arm(), recording))


def record_simulated(configuration: Configuration, device: Hardware | None = None) -> Recording:
    """Go through the plan of a calibration with a simulated arm, and return what was recorded.

    ``device`` stands in the place of the configuration's. Raises CalibrationError when the arm
    stops following.
    """
    run = _Run(configuration, device or backends.build(configuration, configuration.build_arm()))
    run.activate()
    rows, rng, pacer = list[Sample](), np.random.default_rng(0), Pacer(configuration)
    _go(run, first_moves(configuration)[0], pacer, rows, rng)
    pace = pace_after(configuration, _recording(rows))
    _go(run, plan(run.arm, pace), pacer, rows, rng)
    return _recording(rows)


#: Time, pressures sent and measured, tip position and rotation.
Sample = tuple[float, Array, Array, Array, Array]


def _recording(rows: list[Sample]) -> Recording:
    return Recording(*(np.array(column) for column in zip(*rows, strict=True)))


def _go(
    run: _Run, moves: list[Move], pacer: Pacer, rows: list[Sample], rng: np.random.Generator
) -> None:
    """Go through moves from the vented arm on; what is seen on the way is added to the rows."""
    start = np.zeros((run.arm.n_sections, 3))
    tell, whole_s, done_s = progress(), duration_s(moves), 0.0
    for move in moves:
        newest = partial(_newest, rows, len(rows))
        pacer.begin(move)
        while run.ticks % _LOOK_TICKS or not move.over(pacer.elapsed_s, newest):
            tick = run.follow(move.at(start, pacer.elapsed_s))
            sent, measured = tick["pressure_sent_pa"].ravel(), tick["pressure_measured_pa"].ravel()
            pacer.see(1e-9 * run.now_ns, sent.tolist(), measured.tolist())
            pacer.go_on(1e-9 * _PERIOD_NS)
            if run.ticks % _SAMPLE_TICKS == 0:
                rows.append(_sample(run, tick, rng))
        done_s += move.duration_s
        if sys.stderr.isatty():
            tell(done_s, whole_s)
        start = move.pressures_pa


def _sample(run: _Run, tick: np.void, rng: np.random.Generator) -> Sample:
    if tick["mode"] != pb.ACTIVE:
        mode = pb.Mode.Name(int(tick["mode"])).lower()
        raise CalibrationError(f"the simulated arm went to mode {mode}: {run.why}")
    tip = tick["tip_true_position_m"] + rng.normal(0.0, _NOISE_M, 3)
    rotation = rotation_from_quaternion(tick["tip_true_orientation_xyzw"])
    rotation = rotation_from_vector(rng.normal(0.0, _NOISE_RAD, 3)) @ rotation
    sent, measured = tick["pressure_sent_pa"], tick["pressure_measured_pa"]
    return 1e-9 * run.now_ns, sent, measured, tip, rotation


def _newest(rows: list[Sample], first: int, seconds: float) -> tuple[Array, Array, Array]:
    """Times, measured pressures and tips of the newest rows, none before the ``first``."""
    tail = rows[max(first, len(rows) - round(seconds / _SAMPLE_S) - 1) :]
    time_s, _, measured, tip, _ = (np.array(column) for column in zip(*tail, strict=True))
    return time_s, measured, tip

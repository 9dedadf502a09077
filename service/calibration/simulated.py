"""A calibration of the simulated arm in simulated time: the same plan and fit, in seconds.

The loop runs as fast as it can on time that is only counted. What motion capture would measure is
the true tip with noise.
"""

import sys
import time

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.calibration.calibrate import calibrate
from pneuarm.controllers.calibration.plan import duration_s, plan
from pneuarm.controllers.calibration.recording import Recording
from pneuarm.controllers.targets.targets import PressuresTarget
from pneuarm.logs.rings.status import Disk
from pneuarm.logs.rings.tick import tick_dtype
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.calibration.drive import progress
from pneuarm.service.calibration.files import calibrated
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.control.loop import Loop, LoopSettings, Timing
from pneuarm.service.devices import registry as backends
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.modes.mode_keeper import Timeouts
from pneuarm.service.processes.pipe import Command, Heartbeat, RequestMode, SetTarget

_PERIOD_NS = 4_000_000
_SAMPLE_TICKS = 3
_REFRESH_TICKS = 5
_NOISE_M = 1e-4
_READY_TICKS = 1000
_FOREVER = Timeouts(target_s=1.0, arming_s=1e6, hold_s=1e6, full_disk_vent_s=1e6)


class _Run:
    """The loop of a simulated arm, one tick after another."""

    def __init__(self, configuration: Configuration) -> None:
        self.arm = configuration.build_arm()
        device = backends.build(configuration, self.arm)
        device.connect()
        control = configuration.control.model_copy(update={"rate_hz": 1e9 / _PERIOD_NS})
        slower = configuration.model_copy(update={"control": control})
        settings = LoopSettings.of(slower, _FOREVER, 0, time.time_ns())
        self._loop = Loop(self.arm, settings, device, self._ignore)
        self._loop.warm_up()
        self._dtype = tick_dtype(self.arm.n_sections)
        self.now_ns = self.ticks = 0

    @staticmethod
    def _ignore(event: pb.Event) -> None:
        """Nobody reads the events of a run that is only counted."""

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
    run = _Run(configuration)
    run.activate()
    return calibrated(configuration, calibrate(run.arm, _record(run)))


def _record(run: _Run) -> Recording:
    rng, rows = np.random.default_rng(0), []
    moves, start = plan(run.arm), np.zeros((run.arm.n_sections, 3))
    tell, whole_s, begun_ns = progress(), duration_s(moves), run.now_ns
    for move in moves:
        move_ns = run.now_ns
        while (elapsed_s := 1e-9 * (run.now_ns - move_ns)) < move.duration_s:
            tick = run.follow(move.at(start, elapsed_s))
            if run.ticks % _SAMPLE_TICKS == 0:
                tip = tick["tip_true_position_m"] + rng.normal(0.0, _NOISE_M, 3)
                sent, measured = tick["pressure_sent_pa"], tick["pressure_measured_pa"]
                rows.append((1e-9 * run.now_ns, sent, measured, tip))
        if sys.stderr.isatty():
            tell(1e-9 * (run.now_ns - begun_ns), whole_s)
        start = move.pressures_pa
    return Recording(*(np.array(column) for column in zip(*rows, strict=True)))

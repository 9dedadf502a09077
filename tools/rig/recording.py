"""A recorder in this process, on real rings, with a clock that the test moves."""

import multiprocessing
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm
from pneuarm.logs.recording.recorder import Recorder, RecorderSettings
from pneuarm.logs.rings.ring import RingWriter
from pneuarm.logs.rings.rings import MessageWriter, Rings
from pneuarm.logs.rings.status import RecorderStatus
from pneuarm.logs.rings.tick import new_tick
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import EVENT
from tools.rig.arms import paper_arm

CONTEXT = multiprocessing.get_context("spawn")
START_NS = 1_800_000_000_000_000_000
RATE_HZ = 500.0
PERIOD_NS = 2_000_000

INFO = pb.Info(arm="paper", config_toml='preset = "paper"\n', bend_max_rad=[2.5], rate_hz=RATE_HZ)


class FakeTime:
    """Stands for the module `time` where the recorder looks at it."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s

    @staticmethod
    def time_ns() -> int:
        return START_NS


class Session:
    """Rings and everything that writes them, and recorders that follow one another."""

    def __init__(self, directory: Path, clock: FakeTime, arm: Arm | None = None) -> None:
        self.clock = clock
        arm = arm or paper_arm()
        self.info = pb.Info()
        self.info.CopyFrom(INFO)
        self.info.bend_max_rad[:] = arm.per_section("bend_max_rad").reshape(-1).tolist()
        self._n_sections = arm.n_sections
        self.rings = Rings.create(CONTEXT, arm.n_sections, RATE_HZ)
        self.status = RecorderStatus.create(CONTEXT)
        self.settings = RecorderSettings(
            directory=directory,
            session="20260102T000000Z-paper",
            arm=arm,
            roll_bytes=1 << 30,
            roll_s=1e9,
            keep_bytes=0,
            min_free_bytes=0,
        )
        self._ticks = RingWriter(self.rings.ticks)
        self._writers = [MessageWriter(memory) for memory in self.rings.messages()]
        self._random = np.random.default_rng(7)
        self._events = 0
        self._first = 0

    @property
    def path(self) -> Path:
        return self.settings.directory / "20260102T000000Z-paper.mcap"

    def configure(self, **changes: object) -> None:
        self.settings = replace(self.settings, **changes)  # type: ignore[arg-type]

    def recorder(self) -> Recorder:
        return Recorder(self.settings, self.info, self.rings, self.status)

    def write_ticks(self, count: int) -> None:
        """Ticks of numbers that do not compress away."""
        for _ in range(count):
            tick = new_tick(self._n_sections)
            tick["sequence"] = self._ticks.last_sequence + 1
            tick["time_unix_ns"] = START_NS + (self._ticks.last_sequence - self._first) * PERIOD_NS
            tick["pressure_measured_pa"] = self._random.normal(size=(self._n_sections, 3))
            tick["tip_estimated_position_m"] = self._random.normal(size=3)
            tick["tip_estimated_orientation_xyzw"] = (0.0, 0.0, 0.0, 1.0)
            self._ticks.write(tick.tobytes())

    def begin_at(self, sequence: int) -> None:
        """Let every ring count as after very many records, all of them recorded."""
        self._first = sequence
        for memory in (self.rings.ticks, *self.rings.messages()):
            struct.pack_into("@Q", memory.view(), 0, sequence)
        self._ticks = RingWriter(self.rings.ticks)
        self._writers = [MessageWriter(memory) for memory in self.rings.messages()]
        self.status.publish_progress(sequence + 1, [sequence + 1] * len(self._writers), 0)

    def write_events(self, count: int, time_unix_ns: int = START_NS) -> None:
        """Numbered events, from all writing processes in turn."""
        for _ in range(count):
            self._events += 1
            event = pb.Event(text=f"event {self._events}", time_unix_ns=time_unix_ns)
            self._writers[self._events % len(self._writers)].write(EVENT, event, time_unix_ns)

    def flush(self, recorder: Recorder) -> None:
        """Let the recorder take everything and put it on the disk."""
        while recorder.step():
            pass
        self.clock.now_s += 1.0
        recorder.step()


MakeSession = Callable[[], Session]


def make_session(
    directory: Path, monkeypatch: pytest.MonkeyPatch, arm: Arm | None = None
) -> Session:
    """Make a session whose recorders look at a clock of its own, as long as the patch holds."""
    clock = FakeTime()
    monkeypatch.setattr("pneuarm.logs.recording.recorder.time", clock)
    return Session(directory, clock, arm)


def recorded(path: Path) -> tuple[list[int], list[str]]:
    """Numbers of the ticks and texts of the events in a session."""
    from pneuarm.logs.reading.reader import LogReader

    messages = [entry.message for entry in LogReader(path)]
    ticks = [message.sequence for message in messages if isinstance(message, pb.ArmState)]
    events = [message.text for message in messages if isinstance(message, pb.Event)]
    return ticks, events

"""The recorder: every tick and every message of the rings into MCAP; what is lost is counted.

It runs in its own process, so that compression and a slow disk stall nobody. What it has not yet
written waits in the rings; where the disk is full it keeps trying, and says so. Where it does not
keep up it leaves out compression and what can be computed from the ticks, before it loses a tick.
"""

import contextlib
import os
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneuarm.controllers.arm.arm import Arm
from pneuarm.logs.foxglove.body import body_points
from pneuarm.logs.foxglove.frames import frame_transforms, tip_pose
from pneuarm.logs.recording.part import Part
from pneuarm.logs.recording.session import delete_oldest, part_path
from pneuarm.logs.rings.ring import RingReader
from pneuarm.logs.rings.rings import MessageReader, Rings
from pneuarm.logs.rings.state_packer import StatePacker
from pneuarm.logs.rings.status import FAR_BEHIND, Disk, RecorderStatus
from pneuarm.logs.rings.tick import tick_dtype
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import BODY, INFO, STATE, TF, TIP, Topic

_TICKS_AT_ONCE = 500
_FLUSH_S = 0.4

#: The facts stand in the file this often, so that a damaged beginning does not take them away.
_FACTS_S = 10.0

#: Shares of the ring: behind by this much chunks are not compressed any more, until by this little.
_BEHIND, _CAUGHT_UP = 1 / 8, 1 / 32

#: A disk that takes nothing must not fill the memory instead: ten minutes or so of ticks.
_MOST_PENDING_BYTES = 256 * 1024 * 1024


@dataclass(frozen=True)
class RecorderSettings:
    """Where and how to record; ``keep_bytes`` 0 keeps every session."""

    directory: Path
    session: str
    arm: Arm
    roll_bytes: int
    roll_s: float
    keep_bytes: int
    min_free_bytes: int


def _every(topic: Topic, rate_hz: float) -> int:
    """Every how many ticks a topic is logged."""
    return max(1, round(rate_hz / (topic.logged_rate_hz or rate_hz)))


class Recorder:
    """Drains the rings into the parts of one session. A successor goes on where one died."""

    def __init__(
        self, settings: RecorderSettings, info: pb.Info, rings: Rings, status: RecorderStatus
    ) -> None:
        self._settings, self._info, self._status = settings, info, status
        self._dtype = tick_dtype(settings.arm.n_sections)
        self._state = StatePacker(settings.arm.n_sections)
        next_tick, next_messages, self._next_part = status.progress(len(rings.messages()))
        self._capacity = rings.ticks.capacity
        self._ticks = RingReader(rings.ticks, max(1, next_tick))
        self._messages = MessageReader(rings.messages(), next_messages)
        self._missed_before = status.missed_ticks, status.missed_messages
        self._disk = Disk.OK
        self._finishing: list[Part] = []
        self._frames_every = _every(TF, info.rate_hz)
        self._body_every = _every(BODY, info.rate_hz)
        self._time_unix_ns = self._first_unix_ns()
        self._part = self._open_part()
        self._publish()

    def _open_part(self) -> Part:
        settings = self._settings
        settings.directory.mkdir(parents=True, exist_ok=True)
        delete_oldest(settings.directory, settings.keep_bytes)
        path = part_path(settings.directory, settings.session, self._next_part)
        while os.path.lexists(path):  # of a predecessor that died before it could tell of it
            self._next_part += 1
            path = part_path(settings.directory, settings.session, self._next_part)
        part = Part(path, self._info.arm, settings.session, self._next_part)
        part.add_metadata("pneuarm", {"config_toml": self._info.config_toml})
        self._write_facts(part)
        with contextlib.suppress(OSError):  # the flush to come tries again, and reports
            part.flush()  # from here on the file reads as a log
        self._next_part += 1
        self._opened_s = self._flushed_s = time.monotonic()
        return part

    def _write_facts(self, part: Part) -> None:
        part.write(INFO, self._info.SerializeToString(), self._time_unix_ns)
        self._facts_s = time.monotonic()

    def _first_unix_ns(self) -> int:
        """Time of the first tick to be written, so that the log's time never runs backwards."""
        record = self._ticks.record(self._ticks.next_sequence)
        if record is None:
            return time.time_ns()
        return int(np.frombuffer(record, self._dtype)[0]["time_unix_ns"])

    def step(self) -> int:
        """Move what is new into the file, flush and roll when due; return the number of records.

        Messages go first: there are few, and no other record tells what they tell.
        """
        if self._part.pending_bytes > _MOST_PENDING_BYTES:
            self._flush(time.monotonic())  # a full disk: what is new waits in the rings
            return 0
        messages = self._messages.read()
        for topic, payload, time_unix_ns in messages:
            self._part.write(topic, payload, time_unix_ns)
        records = self._ticks.read(_TICKS_AT_ONCE)
        for sequence, record in records:
            self._write_tick(sequence, record)
        self._shed_if_behind()
        now = time.monotonic()
        if now - self._flushed_s >= _FLUSH_S:
            self._flush(now)
        return len(records) + len(messages)

    def _shed_if_behind(self) -> None:
        """Give up compression, which only saves space, while the ring fills up."""
        full = self._ticks.behind / self._capacity
        if full > _BEHIND:
            self._part.compress = False
        elif full < _CAUGHT_UP:
            self._part.compress = True

    def _write_tick(self, sequence: int, record: bytes) -> None:
        time_unix_ns = self._time_unix_ns = self._state.time_unix_ns(record)
        self._part.write(STATE, self._state.pack(record), time_unix_ns, sequence)
        if self._ticks.behind > FAR_BEHIND * self._capacity:
            return  # what follows from the ticks can be had from them later
        if sequence % self._frames_every == 0:
            tick = np.frombuffer(record, self._dtype)[0]
            self._part.write(TIP, tip_pose(tick).SerializeToString(), time_unix_ns)
            self._part.write(TF, frame_transforms(tick).SerializeToString(), time_unix_ns)
        if sequence % self._body_every == 0:
            body = body_points(self._settings.arm, np.frombuffer(record, self._dtype)[0])
            self._part.write(BODY, body.SerializeToString(), time_unix_ns)

    def _flush(self, now: float) -> None:
        """Put everything on the disk; on failure keep it and report, to try again next time."""
        self._flushed_s = now
        if now - self._facts_s >= _FACTS_S:
            self._write_facts(self._part)
        try:
            for part in list(self._finishing):
                part.finish()
                self._finishing.remove(part)
            self._part.flush()
        except OSError:
            self._disk = Disk.FULL
        else:
            self._disk = Disk.OK
            self._publish_progress()
            self._roll_if_due(now)
        self._publish()

    def _publish_progress(self) -> None:
        self._status.publish_progress(
            self._ticks.next_sequence, self._messages.next_sequences(), self._next_part
        )

    def _roll_if_due(self, now: float) -> None:
        too_large = self._part.size_bytes >= self._settings.roll_bytes
        if too_large or now - self._opened_s >= self._settings.roll_s:
            try:
                full, self._part = self._part, self._open_part()
            except OSError:
                return  # this part goes on; the next flush tries again
            self._finishing.append(full)

    def _publish(self) -> None:
        space = os.statvfs(self._settings.directory)
        free = space.f_bavail * space.f_frsize
        low = self._disk == Disk.OK and free < self._settings.min_free_bytes
        ticks, messages = self._missed_before
        self._status.publish(
            Disk.LOW if low else self._disk,
            free,
            ticks + self._ticks.missed,
            messages + self._messages.missed,
            self._ticks.behind,
        )

    def finish(self) -> None:
        """Write what is left and close the file; raises OSError if the disk refuses.

        It may be tried again: then what was told after the log's end, such as that the disk
        refuses it, comes too late for it.
        """
        while not self._part.finished and self.step():
            pass
        for part in (*self._finishing, self._part):
            part.finish()
        self._publish_progress()
        self._publish()

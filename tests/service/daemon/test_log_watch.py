"""What the supervisor tells of the log: while it lags and loses, and at the end."""

import multiprocessing
import struct

import pytest

from pneuarm.logs.rings.rings import Rings
from pneuarm.logs.rings.status import Disk, RecorderStatus
from pneuarm.service.daemon.log_watch import LogWatch

CONTEXT = multiprocessing.get_context("spawn")


class Log:
    """Rings with so many records in them, and what their recorder says."""

    def __init__(self) -> None:
        self.rings = Rings.create(CONTEXT, 1, 500.0)
        self.status = RecorderStatus.create(CONTEXT)
        self.watch = LogWatch(self.rings, self.status)

    def lost(self, ticks: int, messages: int = 0, behind: int = 0) -> None:
        self.status.publish(Disk.OK, 1, ticks, messages, behind)

    def codes(self, now_s: float) -> list[str]:
        found = self.watch.look(now_s)
        return [] if found is None else [found.code]


@pytest.fixture
def log() -> Log:
    return Log()


def test_a_loss_is_told_at_once_and_again_when_it_grows(log: Log) -> None:
    assert log.codes(0.0) == []
    log.lost(120, 3)
    found = log.watch.look(1.0)
    assert found is not None
    assert found.code == "log_lacks"
    assert "120 ticks" in found.text
    assert "3 messages" in found.text
    assert "control.rate_hz" in found.remedy
    log.lost(130, 3)
    assert log.codes(1.1) == []  # not at every look
    assert log.codes(7.0) == ["log_lacks"]
    assert log.codes(20.0) == []  # no more than before


def test_that_the_recorder_is_far_behind_is_told_before_it_loses(log: Log) -> None:
    capacity = log.rings.ticks.capacity
    log.lost(0, behind=capacity // 3)
    assert log.codes(0.0) == []
    log.lost(0, behind=capacity * 2 // 3)
    assert log.codes(1.0) == ["log_behind"]
    assert log.codes(2.0) == []
    log.lost(0, behind=0)
    assert log.codes(3.0) == []
    log.lost(0, behind=capacity * 2 // 3)
    assert log.codes(4.0) == ["log_behind"]


def test_the_end_says_what_was_overwritten_and_what_was_never_written(log: Log) -> None:
    rings = (log.rings.ticks, *log.rings.messages())
    for memory, head in zip(rings, (1000, 5, 6, 7), strict=True):
        struct.pack_into("@Q", memory.view(), 0, head)
    log.status.publish_progress(1001, [6, 7, 8], 1)
    assert log.watch.lacks() == ""
    log.status.publish_progress(901, [6, 7, 7], 1)
    log.lost(50)
    assert "150 ticks" in log.watch.lacks()
    assert "1 messages" in log.watch.lacks()


def test_progress_is_seen(log: Log) -> None:
    before = log.watch.recorded()
    assert log.watch.recorded() == before
    log.status.publish_progress(10, [1, 1, 1], 1)
    assert log.watch.recorded() != before

"""What recorder and viewer tell: numbers in shared memory, one writer, any reader."""

from multiprocessing.context import SpawnProcess

import pytest

from pneuarm.logs.rings.status import Disk, RecorderStatus, ViewerStatus
from tools.rig.recording import CONTEXT


def test_before_the_recorder_has_said_anything() -> None:
    status = RecorderStatus.create(CONTEXT)
    assert (status.disk, status.free_bytes, status.missed) == (Disk.STARTING, 0, 0)
    assert status.progress(3) == (0, [1, 1, 1], 0)


@pytest.mark.parametrize("disk", list(Disk))
def test_what_was_published_is_read(disk: Disk) -> None:
    status = RecorderStatus.create(CONTEXT)
    status.publish(disk, 2**50, 7)
    status.publish_progress(1234, [5, 6, 7], 2)
    assert (status.disk, status.free_bytes, status.missed) == (disk, 2**50, 7)
    assert status.progress(3) == (1234, [5, 6, 7], 2)


def test_publishing_one_thing_leaves_the_other() -> None:
    status = RecorderStatus.create(CONTEXT)
    status.publish_progress(10, [2, 3, 4], 1)
    status.publish(Disk.FULL, 5, 6)
    assert status.progress(3) == (10, [2, 3, 4], 1)
    status.publish_progress(11, [3, 4, 5], 1)
    assert (status.disk, status.free_bytes, status.missed) == (Disk.FULL, 5, 6)


def speak(recorder: RecorderStatus, viewer: ViewerStatus) -> None:
    recorder.publish(Disk.LOW, 99, 1)
    recorder.publish_progress(8, [9, 10, 11], 4)
    viewer.publish(42)


def test_it_is_seen_from_another_process_and_outlives_it() -> None:
    recorder, viewer = RecorderStatus.create(CONTEXT), ViewerStatus.create(CONTEXT)
    assert viewer.skipped == 0
    child: SpawnProcess = CONTEXT.Process(target=speak, args=(recorder, viewer))
    child.start()
    child.join(30)
    assert child.exitcode == 0
    assert (recorder.disk, recorder.free_bytes, recorder.missed) == (Disk.LOW, 99, 1)
    assert recorder.progress(3) == (8, [9, 10, 11], 4)
    assert viewer.skipped == 42

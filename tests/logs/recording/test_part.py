"""One file: what a full disk refuses is kept and offered again. The refusal here is real."""

import fcntl
import multiprocessing
import resource
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from pneuarm.logs.recording.part import Part, PatientFile
from pneuarm.logs.recording.session import is_finished
from pneuarm.logs.rings.status import Disk
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import ESTOP, EVENT
from tools.rig.recording import make_session, recorded


def in_child(target: Callable[[Path, Connection], None], path: Path) -> list[object]:
    """Run a function in a process of its own, whose limits nobody else feels; what it sent."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    child = context.Process(target=target, args=(path, theirs))
    child.start()
    theirs.close()
    messages = []
    while True:
        try:
            messages.append(ours.recv())
        except EOFError:
            break
    child.join(20)
    assert child.exitcode == 0
    return messages


def limit_files(size: int) -> None:
    """Let writes beyond this size fail with EFBIG, as they do on a full disk."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    resource.setrlimit(resource.RLIMIT_FSIZE, (size if size >= 0 else hard, hard))


def fill_a_patient_file(path: Path, tell: Connection) -> None:
    file = PatientFile(path)
    limit_files(1000)
    for _ in range(30):
        file.write(b"0123456789" * 10)
    for _ in range(3):
        try:
            file.drain()
        except OSError as error:
            tell.send((error.errno, path.stat().st_size, file.tell()))
    limit_files(-1)
    file.drain()
    file.write(b"end")
    file.drain()
    file.close()


def test_a_patient_file_keeps_what_the_disk_does_not_take(tmp_path: Path) -> None:
    path = tmp_path / "patient"
    refused = in_child(fill_a_patient_file, path)
    assert refused == [(27, 1000, 3000)] * 3  # EFBIG, each time, after as much as there was room
    assert path.read_bytes() == b"0123456789" * 300 + b"end"


def record_onto_a_full_disk(directory: Path, tell: Connection) -> None:
    with pytest.MonkeyPatch.context() as patch:
        session = make_session(directory, patch)
        recorder = session.recorder()

        def write(times: int) -> None:
            for _ in range(times):
                session.write_ticks(200)
                session.write_events(5)
                session.flush(recorder)
                tell.send((session.status.disk, session.status.progress(3)[0]))

        write(2)
        limit_files(session.path.stat().st_size + 500)
        write(3)
        limit_files(-1)
        write(1)
        recorder.finish()


def test_on_a_full_disk_nothing_is_lost_and_the_status_says_so(tmp_path: Path) -> None:
    told = in_child(record_onto_a_full_disk, tmp_path / "sessions")
    assert [disk for disk, _ in told] == [Disk.OK] * 2 + [Disk.FULL] * 3 + [Disk.OK]
    # While the disk is full a successor would have to begin where it was still good.
    assert [tick for _, tick in told] == [201, 401, 401, 401, 401, 1201]
    ticks, texts = recorded(tmp_path / "sessions" / "20260102T000000Z-paper.mcap")
    assert ticks == list(range(1, 1201))
    assert set(texts) == {f"event {number}" for number in range(1, 31)}
    assert len(texts) == 30


def test_nothing_is_written_before_it_is_drained(tmp_path: Path) -> None:
    file = PatientFile(tmp_path / "patient")
    assert file.write(b"abc") == 3
    assert (file.tell(), (tmp_path / "patient").read_bytes()) == (3, b"")
    file.drain()
    assert (tmp_path / "patient").read_bytes() == b"abc"
    file.close()


def test_an_existing_file_is_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / "there").write_bytes(b"precious")
    with pytest.raises(FileExistsError):
        PatientFile(tmp_path / "there")
    assert (tmp_path / "there").read_bytes() == b"precious"


def test_the_file_is_locked_until_it_is_closed(tmp_path: Path) -> None:
    file = PatientFile(tmp_path / "patient")
    with (tmp_path / "patient").open("rb") as other:
        with pytest.raises(BlockingIOError):
            fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
        file.close()
        file.close()  # twice is no harm
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)


def test_a_key_without_a_message_cannot_be_logged(tmp_path: Path) -> None:
    part = Part(tmp_path / "part.mcap", "paper")
    with pytest.raises(ValueError, match="cmd/estop has no message type"):
        part.write(ESTOP, b"", 1)
    part.finish()


def test_what_is_flushed_is_on_the_disk_and_what_is_finished_is_closed(tmp_path: Path) -> None:
    part = Part(tmp_path / "part.mcap", "paper")
    part.write(EVENT, pb.Event(text="one").SerializeToString(), 1)
    part.flush()
    size = (tmp_path / "part.mcap").stat().st_size
    assert size == part.size_bytes > 0
    assert not is_finished(tmp_path / "part.mcap")
    part.finish()
    part.finish()
    assert is_finished(tmp_path / "part.mcap")

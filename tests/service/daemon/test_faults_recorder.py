"""The recorder stands still, dies, or has no room: nothing is lost, and the arm knows."""

import errno
import os
import resource
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from pneuarm.controllers.arm.errors import LogError, ModeRefused
from pneuarm.logs.reading.summary import LogSummary, summarise
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.client import Client
from pneuarm.service.daemon import recorder as recording
from tools.rig.daemon import Daemon, arm, enough, health_of, keep_moving, wait_for


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    tables = {"log": {"full_disk_vent_s": 1.0}}
    with Daemon(tmp_path_factory.mktemp("recorder"), tables) as daemon:
        yield daemon


@pytest.fixture
def client(daemon: Daemon) -> Iterator[Client]:
    with daemon.client() as client:
        arm(client)
        yield client


def caught_up(daemon: Daemon, client: Client) -> LogSummary:
    """Wait until the log holds what is now the newest tick; return what it says then."""
    newest = client.state().sequence

    def summary() -> LogSummary | None:
        found = summarise(daemon.log())
        return found if found.ticks + found.missing_ticks >= newest else None

    return wait_for(summary, "the newest tick in the log")


def lost(client: Client) -> int:
    """Return what health tells of records lost."""
    return sum(p.dropped for p in health_of(client).processes if p.name == "recorder")


def test_recorder_stopped_for_a_while_loses_nothing(daemon: Daemon, client: Client) -> None:
    recorder = daemon.pids("recorder")["recorder"]
    with daemon.standing_still(recorder):
        keep_moving(client, enough(3.0), "three seconds of movement without a recorder")
        stopped_at = summarise(daemon.log()).ticks
        assert client.state().sequence - stopped_at > 2000
    keep_moving(client, lambda: summarise(daemon.log()).ticks > stopped_at + 2000, "catching up")
    summary = caught_up(daemon, client)
    assert summary.missing_ticks == 0
    assert summary.parts == 1
    assert lost(client) == 0


def test_recorder_killed_is_revived_and_nothing_is_missing(daemon: Daemon, client: Client) -> None:
    for _ in range(2):
        recorder = daemon.pids("recorder")["recorder"]
        keep_moving(client, enough(0.5), "some movement")
        daemon.send_signal_to(recorder, signal.SIGKILL)
        keep_moving(
            client,
            lambda before=recorder: daemon.pids("recorder")["recorder"] != before,
            "another recorder",
        )
    summary = caught_up(daemon, client)
    assert summary.missing_ticks == 0
    assert summary.parts >= 2
    wait_for(lambda: daemon.codes().count("recorder_restarted") == 2, "both restarts in the log")
    assert lost(client) == 0


def test_full_disk_arm_holds_then_vents_and_nothing_is_missing(
    daemon: Daemon, client: Client
) -> None:
    recorder = daemon.pids("recorder")["recorder"]
    limit = resource.prlimit(recorder, resource.RLIMIT_FSIZE)
    caught_up(daemon, client)
    before = len(daemon.codes())
    client.send_position((0.0, 0.0, 0.2))
    fill_disk(daemon, recorder)
    events: list[pb.Event] = []

    def vented() -> bool:
        events.extend(event for event in client.events() if event.code.startswith("disk"))
        client.send_position((0.0, 0.0, 0.2))
        return len(events) > 1

    try:
        wait_for(vented, "the event of the full disk")
        assert [event.code for event in events] == ["disk_full", "disk_still_full"]
        assert [event.mode for event in events] == [pb.HOLD, pb.IDLE]
        assert "disk" in events[0].cause
        assert "free some space" in events[0].remedy
        wait_for(lambda: client.state().mode == pb.READY, "an empty arm")
        with pytest.raises(ModeRefused, match="too little free space to record"):
            client.enable()
    finally:
        resource.prlimit(recorder, resource.RLIMIT_FSIZE, limit)
    summary = caught_up(daemon, client)
    assert summary.missing_ticks == 0
    assert "disk_full" in daemon.codes()[before:]
    assert lost(client) == 0
    wait_for(lambda: enabled(client), "the arm to be enabled with room again")


def fill_disk(daemon: Daemon, recorder: int) -> None:
    """Let no file of the recorder grow beyond the log as it is now."""
    size = daemon.log().parts[-1].stat().st_size
    hard = resource.prlimit(recorder, resource.RLIMIT_FSIZE)[1]
    resource.prlimit(recorder, resource.RLIMIT_FSIZE, (size, hard))


def enabled(client: Client) -> bool:
    """Try to arm."""
    try:
        client.enable()
    except ModeRefused:
        return False
    return True


def test_low_disk_refuses_to_enable_and_says_why(tmp_path: Path) -> None:
    with Daemon(tmp_path, {"log": {"min_free_mib": 1e9}}) as daemon, daemon.client() as client:
        with pytest.raises(ModeRefused, match=r"too little free space .* log\.min_free_mib"):
            client.enable()
        assert client.state().mode == pb.READY
        found: list[pb.Event] = []

        def told() -> list[pb.Event]:
            found.extend(event for event in client.events() if event.code == "mode_refused")
            return found

        assert "free space" in wait_for(told, "the event that it is refused")[0].text


class FullDisk:
    """A recorder that can write no more."""

    def finish(self) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_disk_full_to_the_end_is_said_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording, "_GIVE_UP_S", 0.0)
    with pytest.raises(LogError, match=r"could not be closed \(No space left"):
        recording._finish(FullDisk())  # type: ignore[arg-type]

"""The viewer stands still or dies: nothing else changes, and it is counted."""

import signal
import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from pneuarm.logs.reading.summary import summarise
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.client import Client
from tools.rig.daemon import Daemon, arm, enough, health_of, keep_moving, wait_for_event


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    tables = {"rerun": {"enabled": True, "memory_limit_mib": 32}}
    with Daemon(tmp_path_factory.mktemp("viewer"), tables) as daemon:
        yield daemon


@pytest.fixture
def client(daemon: Daemon) -> Iterator[Client]:
    known = len(daemon.events())
    with daemon.client() as client:
        arm(client)
        yield client
    new = daemon.events()[known:]
    assert not {"target_stale", "gateway_silent", "fault"} & {event.code for event in new}
    # A lease may be refused until the client before is gone; a target never.
    refused = [event.text for event in new if event.code == "rejected"]
    assert not [text for text in refused if text.startswith("cmd/target")]
    assert summarise(daemon.log()).missing_ticks == 0


def viewer(client: Client) -> pb.ProcessHealth:
    """Return what health tells of the viewer."""
    rows = [process for process in health_of(client).processes if process.name == "viewer"]
    return rows[0] if rows else pb.ProcessHealth()


def listens(daemon: Daemon) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", daemon.rerun_port)) == 0


def skipped_more(client: Client, before: int) -> Callable[[], bool]:
    return lambda: viewer(client).dropped > before


def test_viewer_serves(daemon: Daemon, client: Client) -> None:
    daemon.pids("viewer", "rerun")
    keep_moving(client, lambda: listens(daemon), "Rerun's server")
    with socket.socket() as other:  # and on loopback only
        other.bind(("127.0.0.2", daemon.rerun_port))


def test_viewer_stopped_changes_nothing_and_its_skips_are_counted(
    daemon: Daemon, client: Client
) -> None:
    known = daemon.pids("viewer")["viewer"]
    before = viewer(client).dropped
    with daemon.standing_still(known):
        keep_moving(client, enough(4.5), "movement while the viewer stands still")
    keep_moving(client, skipped_more(client, before + 500), "the skips in health")
    assert viewer(client).pid == known
    assert viewer(client).restarts == 0


def test_viewer_that_stands_still_again_and_again_keeps_no_old_connection(
    daemon: Daemon, client: Client
) -> None:
    known, threads = daemon.pids("viewer")["viewer"], []
    for _ in range(3):
        before = viewer(client).dropped
        with daemon.standing_still(known):
            keep_moving(client, enough(5.5), "a stall after which the viewer connects anew")
        keep_moving(client, skipped_more(client, before), "movement that is viewed again")
        threads.append(len(list(Path(f"/proc/{known}/task").iterdir())))
    assert threads[2] <= threads[1]
    assert viewer(client).restarts == 0


def test_viewer_killed_is_started_again_and_counted(daemon: Daemon, client: Client) -> None:
    killed = daemon.pids("viewer")["viewer"]
    daemon.send_signal_to(killed, signal.SIGKILL)
    keep_moving(client, lambda: viewer(client).restarts == 1, "the restart in health")
    keep_moving(client, lambda: viewer(client).pid != killed, "another viewer")
    wait_for_event(client, "viewer_restarted")
    keep_moving(client, lambda: listens(daemon), "Rerun's server again")


def test_rerun_killed_is_started_again(daemon: Daemon, client: Client) -> None:
    killed = daemon.pids("rerun")["rerun"]
    daemon.send_signal_to(killed, signal.SIGKILL)
    keep_moving(
        client,
        lambda: daemon.pids("viewer").get("rerun", killed) != killed and listens(daemon),
        "another server",
    )

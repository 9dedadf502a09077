"""The gateway dies or stands still, the supervisor stands still: the arm can still be stopped."""

import json
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from pneuarm.logs.reading.summary import summarise
from pneuarm.logs.schema import pneuarm_pb2 as pb
from tools.rig.daemon import Daemon, arm, enough, keep_moving, wait_for


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    with Daemon(tmp_path_factory.mktemp("gateway")) as daemon:
        yield daemon


def ready_again(daemon: Daemon) -> None:
    with daemon.client("reset") as client:
        client.reset()
        wait_for(lambda: client.state().mode == pb.READY, "ready after the reset")


def test_gateway_killed_arm_holds_and_the_client_goes_on(daemon: Daemon) -> None:
    gateway = daemon.pids("gateway")["gateway"]
    with daemon.client() as client:
        client.enable()
        keep_moving(client, enough(0.5), "some movement")
        before = client.state().sequence
        daemon.send_signal_to(gateway, signal.SIGKILL)
        wait_for(lambda: "gateway_restarted" in daemon.codes(), "the gateway started again")
        arm(client)
        state = client.move_to((0.0, 0.0, 0.21))
        assert state.reach == pb.REACHED
        assert state.sequence > before
    codes = daemon.codes()
    silent = daemon.events()[codes.index("gateway_silent")]
    assert silent.mode == pb.HOLD
    assert silent.remedy
    assert daemon.pids("gateway")["gateway"] != gateway
    assert [p.restarts for p in daemon.health().processes if p.name == "gateway"] == [1]


def test_gateway_stopped_arm_holds_then_vents(daemon: Daemon) -> None:
    gateway = daemon.pids("gateway")["gateway"]
    with daemon.client() as client:
        arm(client)
        keep_moving(client, enough(0.5), "some movement")
        known = len(daemon.codes())
        with daemon.standing_still(gateway):
            wait_for(lambda: "gateway_lost" in daemon.codes()[known:], "the arm to vent")
        arm(client)
    new = daemon.codes()[known:]
    assert new[:2] == ["gateway_silent", "gateway_lost"]
    assert [event.mode for event in daemon.events()[known:]][:2] == [pb.HOLD, pb.IDLE]


def test_local_stop_works_while_the_gateway_stands_still(daemon: Daemon) -> None:
    gateway = daemon.pids("gateway")["gateway"]
    with daemon.client() as client:
        arm(client)
        with daemon.standing_still(gateway):
            done = daemon.command("estop", "--json")
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout) == {"stopped": True, "confirmed": "on this machine"}
        wait_for(lambda: client.state().mode == pb.ESTOP, "the stop in the state")
    ready_again(daemon)


def test_stop_goes_through_the_network_while_the_supervisor_stands_still(daemon: Daemon) -> None:
    with daemon.client() as client:
        arm(client)
        daemon.send_signal(signal.SIGSTOP)
        try:
            done = daemon.command("estop", "--json")
            assert client.state().mode == pb.ESTOP
        finally:
            daemon.send_signal(signal.SIGCONT)
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["confirmed"] == f"through {daemon.endpoint}"
        # The supervisor wakes to a request whose sender has gone long ago.
        known = client.state().sequence
        wait_for(lambda: client.state().sequence > known + 1000, "the daemon to go on")
    ready_again(daemon)


def test_nothing_can_stop_is_said_clearly(daemon: Daemon) -> None:
    gateway = daemon.pids("gateway")["gateway"]
    before = daemon.output().count("emergency stop")
    daemon.send_signal(signal.SIGSTOP)
    daemon.send_signal_to(gateway, signal.SIGSTOP)
    try:
        done = daemon.command("estop")
    finally:
        daemon.send_signal_to(gateway, signal.SIGCONT)
        daemon.send_signal(signal.SIGCONT)
    assert done.returncode == 1
    assert "NOT CONFIRMED" in done.stderr
    assert "cut the air supply" in done.stderr
    assert "Traceback" not in done.stderr
    wait_for(lambda: daemon.output().count("emergency stop") > before, "the belated stop")
    ready_again(daemon)


def test_daemon_ends_well_although_the_gateway_stands_still(tmp_path: Path) -> None:
    with Daemon(tmp_path) as daemon:
        daemon.send_signal_to(daemon.pids("gateway")["gateway"], signal.SIGSTOP)
        daemon.stop()
        assert "the gateway process did not end by itself and was killed" in daemon.output()
        summary = summarise(daemon.log())
        assert summary.finished
        assert summary.missing_ticks == 0

"""Two clients and one arm: who holds it, and what happens when the holder goes or hangs."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pneuarm.controllers.arm.errors import LeaseRefused, TargetRejected
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.client import Client
from tools.rig.daemon import ROOT, Daemon, arm, enough, keep_moving, wait_for

SENDER = """
import sys, time
from pneuarm import Client

with Client(sys.argv[1], sys.argv[2], "sender") as client:
    client.enable()
    while True:
        client.send_position((0.02, 0.0, 0.2))
        time.sleep(0.01)
"""


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    tables = {"control": {"target_timeout_ms": 500}}
    with Daemon(tmp_path_factory.mktemp("lease"), tables) as daemon:
        yield daemon


@pytest.fixture
def watcher(daemon: Daemon) -> Iterator[Client]:
    with daemon.client("watcher") as client:
        yield client


@pytest.fixture
def sender(daemon: Daemon, watcher: Client, tmp_path: Path) -> Iterator["subprocess.Popen[bytes]"]:
    """A program of somebody else's that sends targets without end."""
    watcher.vent()
    wait_for(lambda: watcher.state().mode == pb.READY, "an empty arm")
    process = subprocess.Popen(
        [sys.executable, "-c", SENDER, daemon.arm, daemon.endpoint], cwd=ROOT
    )
    try:
        wait_for(lambda: watcher.state().target_kind == pb.POSITION, "targets of the sender")
        watcher.events()
        yield process
    finally:
        process.kill()
        process.wait(10)


def held(watcher: Client) -> pb.Event:
    """Wait for the arm to hold; return the event that tells why."""
    events: list[pb.Event] = []

    def found() -> bool:
        told = (event for event in watcher.events() if event.source == "control")
        events.extend(event for event in told if event.mode == pb.HOLD)
        return bool(events)

    wait_for(found, "the event that the arm holds")
    wait_for(lambda: watcher.state().mode == pb.HOLD, "the state that the arm holds")
    return events[0]


def test_second_client_is_refused_with_the_holders_name(daemon: Daemon, watcher: Client) -> None:
    with daemon.client("first") as first:
        arm(first)
        keep_moving(first, enough(0.2), "some movement")
        for refused in (watcher.enable, watcher.take_lease):
            with pytest.raises(LeaseRefused, match=f"{first.client_id} holds the arm"):
                refused()
        with pytest.raises(TargetRejected, match="has no lease"):
            wait_for(
                lambda: watcher.send_position((0.0, 0.0, 0.2)) and watcher.raise_if_refused(),
                "the rejection",
            )
        keep_moving(first, enough(0.2), "the first client goes on")


def settled(watcher: Client) -> list[float]:
    """Wait until what went ahead for the valves' lag has come back; return what is held."""

    def held_pa() -> list[float]:
        state = watcher.state()
        sent = list(state.pressure_sent_pa)
        return sent if sent == list(state.pressure_commanded_pa) else []

    return wait_for(held_pa, "the held pressures")


def test_taking_over_makes_the_arm_hold_and_shuts_the_first_out(
    daemon: Daemon, watcher: Client
) -> None:
    with daemon.client("first") as first:
        arm(first)
        keep_moving(first, enough(0.3), "some movement")
        watcher.events()
        reply = watcher.take_lease(take_over=True)
        assert reply.lease_holder == watcher.client_id
        assert held(watcher).code == "lease_lost"
        before = settled(watcher)
        with pytest.raises(TargetRejected, match=f"has no lease; {watcher.client_id} has it"):
            wait_for(
                lambda: first.send_position((0.0, 0.0, 0.2)) and first.raise_if_refused(),
                "the rejection",
            )
        assert watcher.state().mode == pb.HOLD
        assert list(watcher.state().pressure_sent_pa) == before
        watcher.enable()
        assert watcher.move_to((0.0, 0.0, 0.2)).reach == pb.REACHED
    watcher.release()


def test_arm_holds_when_its_client_is_killed(
    daemon: Daemon, watcher: Client, sender: "subprocess.Popen[bytes]"
) -> None:
    daemon.breaks("client")
    sender.kill()
    assert held(watcher).code in ("lease_lost", "target_stale")
    watcher.enable()  # its lease went with it
    watcher.release()


def test_arm_holds_when_its_client_hangs(
    daemon: Daemon, watcher: Client, sender: "subprocess.Popen[bytes]"
) -> None:
    daemon.breaks("client")
    sender.send_signal(signal.SIGSTOP)
    event = held(watcher)
    assert event.code == "target_stale"
    assert event.remedy
    before = settled(watcher)
    sender.send_signal(signal.SIGCONT)
    # What the program sends after its pause moves nothing: somebody has to arm again.
    number = watcher.state().sequence
    wait_for(lambda: watcher.state().sequence > number + 300, "some ticks")
    assert watcher.state().mode == pb.HOLD
    assert list(watcher.state().pressure_sent_pa) == before


def test_lease_of_a_silent_client_runs_out(
    daemon: Daemon, watcher: Client, sender: "subprocess.Popen[bytes]"
) -> None:
    daemon.breaks("client")
    sender.send_signal(signal.SIGSTOP)
    with pytest.raises(LeaseRefused, match=r"sender@.* holds the arm"):
        watcher.take_lease()
    arm(watcher)  # without taking over, once the lease has run out
    watcher.release()


def test_arm_without_targets_of_its_operator_goes_stale(daemon: Daemon, watcher: Client) -> None:
    watcher.events()
    with daemon.client("quiet") as quiet:
        arm(quiet)
        keep_moving(quiet, enough(0.2), "some movement")
        daemon.breaks("client")
        assert held(watcher).code == "target_stale"

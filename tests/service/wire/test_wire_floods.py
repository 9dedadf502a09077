"""Floods: whoever sends whatever it can, a stop gets through, and little is written down."""

import contextlib
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from pneuarm.logs.schema import pneuarm_pb2 as pb
from tools.rig.daemon import PATIENCE_S, ROOT, Daemon, wait_for

SECONDS = 4.0

FLOOD = """
import os, sys, time
import zenoh
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import full_key
from pneuarm.service.client.target_messages import trajectory_target
from pneuarm.service.network.sessions import open_connected
arm, endpoint, kind = sys.argv[1:]
session = open_connected(endpoint)
target = trajectory_target([(0.1 + 0.01 * n, (1e-4 * n, 0.0, 0.2)) for n in range(200)])
target.client_id = "flood"
request = pb.ModeRequest(client_id="flood", action=pb.ENABLE).SerializeToString()
shape, number = target.SerializeToString(), 0
block = zenoh.CongestionControl.BLOCK
key = lambda name: full_key(arm, name)
print("begun", flush=True)
while True:
    number += 1
    if kind == "shapes":
        session.put(key("cmd/target"), shape, congestion_control=block)
    elif kind == "json":
        session.put(key("cmd/target"), b"[" * 60000, encoding="application/json")
    elif kind == "megabytes":
        session.put(key("cmd/target"), bytes(1000000), congestion_control=block)
    elif kind == "names":
        small = pb.Target(client_id=f"stranger {number}")
        session.put(key("cmd/target"), small.SerializeToString(), congestion_control=block)
    elif kind == "poses":
        session.put(key(f"sensor/tip_pose/{number % 7}"), b"x", congestion_control=block)
    elif kind == "requests":
        session.get(key("cmd/mode"), payload=request, timeout=1.0)
    elif kind == "questions":
        session.get(key("info"), timeout=1.0)
    elif kind == "tokens":
        session.liveliness().declare_token(key(f"alive/client/x{number}")).undeclare()
    if number % 100 == 0:
        time.sleep(0.001)  # as fast as a network would let it, not faster
"""

KINDS = (
    "shapes", "json", "megabytes", "names", "poses", "requests", "questions", "tokens",
)  # fmt: skip


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    with Daemon(tmp_path_factory.mktemp("floods")) as daemon:
        yield daemon


@contextlib.contextmanager
def flood(daemon: Daemon, kind: str) -> Iterator[None]:
    command = [sys.executable, "-c", FLOOD, daemon.arm, daemon.endpoint, kind]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE)
    try:
        assert process.stdout is not None
        process.stdout.readline()
        yield
    finally:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("kind", KINDS)
def test_a_stop_gets_through_and_little_is_told(daemon: Daemon, kind: str) -> None:
    with daemon.client("watcher") as watcher:
        gateway = daemon.pids("gateway")["gateway"]
        watcher.events()
        events: list[pb.Event] = []
        begun_s = time.monotonic()
        with flood(daemon, kind):
            while time.monotonic() - begun_s < SECONDS:
                events += watcher.events()
                time.sleep(0.05)
            assert watcher.estop(timeout_s=PATIENCE_S).mode == pb.ESTOP
        lasted_s = time.monotonic() - begun_s
        events += watcher.events()
        # At most 20 new ones a second, told again once, the counts, and the changes of mode.
        assert len(events) <= 45 * (lasted_s + 1.0) + 10
        assert all(event.text.isprintable() for event in events)
        assert watcher.reset().mode == pb.IDLE
        wait_for(lambda: watcher.state().mode == pb.READY, "the arm to be ready again")
        assert daemon.pids("gateway")["gateway"] == gateway


def test_what_is_refused_again_and_again_is_told_with_its_number(daemon: Daemon) -> None:
    with daemon.client("sender") as sender, daemon.client("watcher") as watcher:
        found: list[pb.Event] = []

        def counted() -> bool:
            sender.send_position((0.0, 0.0, 0.2))  # until enough are told: one may be lost
            told = (event for event in watcher.events() if event.code == "rejected")
            found.extend(event for event in told if event.client_id == sender.client_id)
            return sum(event.repeats or 1 for event in found) >= 300

        wait_for(counted, lambda: f"300 refusals to be told; told are {found}")
        assert len(found) < 30
        # The terminal says it at once, then ever more rarely.
        assert 1 <= sum(sender.client_id in line for line in daemon.output().splitlines()) <= 6

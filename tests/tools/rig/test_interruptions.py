"""A test is done again where the machine made the arm hold, and nowhere else."""

import subprocess
import sys
from pathlib import Path

from tools.rig.daemon import PATIENCE_S, ROOT, Daemon
from tools.rig.interruptions import TIMES

assert Daemon  # this module starts daemons, one worker for all that do

CONFTEST = """
from tools.rig.interruptions import DoneAgain

def pytest_configure(config):
    config.pluginmanager.register(DoneAgain())
"""

#: The first test of each kind that is done stops the gateway, in the machine's place or its own.
TESTS = """
import os, signal
from pathlib import Path
import pytest
from pneuarm.logs.schema import pneuarm_pb2 as pb
from tools.rig.daemon import Daemon, arm, wait_for

RUNS = Path(__file__).with_name("runs.txt")

@pytest.fixture(scope="module")
def daemon(tmp_path_factory):
    with Daemon(tmp_path_factory.mktemp("daemon")) as daemon:
        yield daemon

def stalls(daemon, stop):
    with daemon.client() as client:
        arm(client)
        gateway = daemon.pids("gateway")["gateway"]
        stop(gateway, signal.SIGSTOP)
        try:
            wait_for(lambda: "gateway_silent" in daemon.codes(), "the hold")
        finally:
            os.kill(gateway, signal.SIGCONT)
        wait_for(lambda: client.state().mode in (pb.HOLD, pb.IDLE, pb.READY), "the mode")

def first(name):
    with RUNS.open("a") as runs:
        runs.write(name + "\\n")
    return RUNS.read_text().split().count(name) == 1

def test_machine(daemon):
    if first("machine"):
        stalls(daemon, os.kill)
        pytest.fail("the arm holds")

def test_wrong():
    first("wrong")
    pytest.fail("nothing was told")

def test_own(daemon):
    first("own")
    stalls(daemon, daemon.send_signal_to)
    pytest.fail("the arm holds, and this test wanted it so")

def test_always(daemon):
    first("always")
    stalls(daemon, os.kill)
    pytest.fail("the arm holds each time")
"""


def test_it_is_done_again_where_the_daemon_blames_the_machine_and_nowhere_else(
    tmp_path: Path,
) -> None:
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "test_four.py").write_text(TESTS)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=2 * PATIENCE_S,
    )
    runs = (tmp_path / "runs.txt").read_text().split()
    assert runs.count("machine") >= 2, done.stdout  # more where the machine has a part in it
    assert [runs.count(name) for name in ("wrong", "own", "always")] == [1, 1, TIMES], done.stdout
    assert "3 failed, 1 passed" in done.stdout
    assert "done again" in done.stdout
    assert "gateway_silent" in done.stdout

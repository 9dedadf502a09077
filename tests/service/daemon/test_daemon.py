"""One daemon from its start to its end: what it says, how it ends, what a crash leaves."""

import signal
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.reading.summary import summarise
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.control.loop import NEAR_ZERO_PA
from tools.rig.daemon import Daemon, enough, has_air, keep_moving, wait_for


@pytest.fixture
def daemon(tmp_path: Path) -> Iterator[Daemon]:
    daemon = Daemon(tmp_path).start()
    try:
        yield daemon
    finally:
        daemon.kill()


def test_start_says_one_line_a_fact(daemon: Daemon) -> None:
    lines = daemon.output().splitlines()
    facts = {line.split()[0]: line for line in lines[:7]}
    assert list(facts) == ["arm", "adapter", "rate", "real", "zenoh", "rerun", "log"]
    assert f"{daemon.arm}: 1 section, 3 chambers" in facts["arm"]
    assert "simulator" in facts["adapter"]
    assert "1000 Hz" in facts["rate"]
    assert "granted" in facts["real"]
    assert daemon.endpoint in facts["zenoh"]
    assert facts["rerun"].endswith("off")
    assert Path(facts["log"].split()[1]).is_file()
    daemon.stop()


@pytest.mark.parametrize(
    ("number", "to_all"),
    [(signal.SIGINT, True), (signal.SIGINT, False), (signal.SIGTERM, False), (signal.SIGHUP, True)],
)
def test_signal_ends_with_vented_arm_and_closed_log(
    daemon: Daemon, number: int, to_all: bool
) -> None:
    """A terminal sends Ctrl-C to every process of the group, and SIGHUP when it is closed."""
    if signal.getsignal(number) is signal.SIG_IGN:
        pytest.skip("the tests run under nohup, and so does their daemon")
    with daemon.client() as client:
        client.enable()
        keep_moving(client, has_air(client, 3 * NEAR_ZERO_PA), "pressure in the arm")
        (daemon.send_signal_to_all if to_all else daemon.send_signal)(number)
        assert daemon.wait() == 0, daemon.output()
    for word in ("Traceback", "killed", "leaked"):
        assert word not in daemon.output()
    log = daemon.log()
    assert log.finished
    ticks = log.ticks()
    assert list(ticks["sequence"]) == list(range(1, len(ticks) + 1))
    assert ticks["mode"][-1] in (pb.IDLE, pb.READY)
    assert np.abs(ticks["pressure_sent_pa"][-1]).max() == 0.0
    assert np.abs(ticks["pressure_measured_pa"][-1]).max() < NEAR_ZERO_PA


def test_killed_daemon_leaves_a_log_that_the_next_one_repairs(daemon: Daemon) -> None:
    with daemon.client() as client:
        client.enable()
        keep_moving(client, enough(2.0), "some movement")
        last = client.state()
        daemon.send_signal_to_all(signal.SIGKILL)
    daemon.wait()
    broken = daemon.log()
    path = broken.parts[0]
    ticks = broken.ticks()
    assert not broken.finished
    assert last.time_unix_ns - ticks["time_unix_ns"][-1] < 1e9
    assert list(ticks["sequence"]) == list(range(1, len(ticks) + 1))
    events = [entry.message.code for entry in broken if isinstance(entry.message, pb.Event)]
    assert "enable" in events

    daemon.start()
    wait_for(lambda: LogReader(path).finished, "the repair")
    daemon.stop()
    assert f"unfinished {path} was left by a crash; repairing it" in daemon.output()
    assert f"repaired   {path}: " in daemon.output()
    assert LogReader(path).ticks().tobytes() == ticks.tobytes()
    assert summarise(daemon.log()).finished
    assert daemon.log().parts[0] != path


def test_ctrl_c_during_the_start_ends_without_a_traceback(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path)
    try:
        daemon.launch()
        wait_for(lambda: "log  " in daemon.output(), "the facts of the start")
        time.sleep(0.15)  # the other processes are just loading their libraries
        daemon.send_signal_to_all(signal.SIGINT)
        assert daemon.wait() == 0
        assert "Traceback" not in daemon.output()
    finally:
        daemon.kill()

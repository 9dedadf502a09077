"""Control or the supervisor dies or stands still: the air goes, the log is closed, and says why."""

import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from pneuarm.logs.reading.summary import summarise
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.control.loop import NEAR_ZERO_PA
from tools.rig.daemon import Daemon, enough, has_air, keep_moving


@pytest.fixture
def daemon(tmp_path: Path) -> Iterator[Daemon]:
    daemon = Daemon(tmp_path).start()
    try:
        yield daemon
    finally:
        daemon.kill()


def bend(daemon: Daemon) -> None:
    """Let the arm move for a while, so that there is air in it."""
    with daemon.client() as client:
        client.enable()
        keep_moving(client, enough(1.0), "a second of movement")
        keep_moving(client, has_air(client, 4 * NEAR_ZERO_PA), "air in the arm")


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_without_control_the_supervisor_vents_and_ends(daemon: Daemon, number: int) -> None:
    control = daemon.pids("control")["control"]
    bend(daemon)
    daemon.send_signal_to(control, number)
    assert daemon.wait() == 3
    lost = [event for event in daemon.events() if event.code == "control_lost"]
    assert len(lost) == 1
    assert lost[0].level == pb.ERROR
    assert lost[0].source == "supervisor"
    assert "vented" in lost[0].text
    assert lost[0].cause
    assert lost[0].remedy
    assert lost[0].text in daemon.output()
    assert "Traceback" not in daemon.output()
    summary = summarise(daemon.log())
    assert summary.finished
    assert summary.missing_ticks == 0
    assert not Path(f"/proc/{control}").exists()


def test_without_supervisor_everything_ends_by_itself_and_vented(daemon: Daemon) -> None:
    bend(daemon)
    before = len(daemon.pids("control", "gateway", "recorder"))
    assert before == 4
    daemon.send_signal(signal.SIGKILL)
    assert daemon.wait() == -signal.SIGKILL
    log = daemon.log()
    assert log.finished
    ticks = log.ticks()
    assert list(ticks["sequence"]) == list(range(1, len(ticks) + 1))
    last = ticks[-1]
    assert last["mode"] in (pb.IDLE, pb.READY)
    assert np.abs(last["pressure_sent_pa"]).max() == 0.0
    assert np.abs(last["pressure_measured_pa"]).max() < NEAR_ZERO_PA
    assert [event.cause for event in daemon.events()].count("the daemon ends") == 1
    assert "Traceback" not in daemon.output()


def test_names_and_ports_are_free_again_after_a_crash(daemon: Daemon) -> None:
    daemon.send_signal_to_all(signal.SIGKILL)
    daemon.wait()
    daemon.start()
    daemon.stop()
    assert daemon.log().finished

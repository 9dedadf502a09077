"""The end comes soon and leaves nobody, also where a process still loads or a library hangs."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pneuarm.service.daemon import supervisor
from pneuarm.service.processes.shared import end_with_parent
from tools.rig.daemon import ROOT, Daemon, wait_for
from tools.rig.processes import process, processes

pytestmark = pytest.mark.slow


def children_of(pid: int) -> list[int]:
    """Processes of the daemon's own that a supervisor has started so far."""
    return [each.pid for each in processes() if each.parent == pid and "spawn_main" in each.command]


def test_the_order_to_end_during_the_start_starts_nothing_more(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path)
    try:
        daemon.launch()
        wait_for(lambda: children_of(daemon.pid), "the control process")
        daemon.send_signal(signal.SIGTERM)  # control is just loading its libraries
        assert daemon.wait() == 0, daemon.output()
        for word in ("killed", "lost", "Traceback"):
            assert word not in daemon.output()
        assert list(daemon.logs.glob("*.mcap")) == []  # there never was a recorder
    finally:
        daemon.kill()


def test_a_viewer_whose_server_stands_still_does_not_outlive_its_supervisor(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path, {"rerun": {"enabled": True}})
    try:
        daemon.start()
        server = daemon.pids("viewer", "rerun")["rerun"]
        daemon.send_signal_to(server, signal.SIGSTOP)
        daemon.send_signal(signal.SIGKILL)
        daemon.wait()
        wait_for(lambda: not Path(f"/proc/{server}").exists(), "the end of Rerun's server")
    finally:
        daemon.kill()


def _hang(pid_path: str) -> None:
    end_with_parent(0.1)
    Path(pid_path).write_text(str(os.getpid()))
    time.sleep(1000.0)


def _start_one_that_hangs(pid_path: str) -> None:
    multiprocessing.get_context("spawn").Process(target=_hang, args=(pid_path,)).start()
    time.sleep(1000.0)


def test_a_process_that_hangs_ends_after_its_parent(tmp_path: Path) -> None:
    note = tmp_path / "pid"
    program = (
        f"from tests.service.daemon import test_ending as t; t._start_one_that_hangs({str(note)!r})"
    )
    parent = subprocess.Popen([sys.executable, "-c", program], cwd=ROOT)
    try:
        pid = int(wait_for(lambda: note.exists() and note.read_text(), "the child"))
        parent.kill()
        parent.wait()
        wait_for(lambda: not _lives(pid), "the end of the child")
    finally:
        parent.kill()


def _lives(pid: int) -> bool:
    try:
        return process(pid).state != "Z"
    except OSError:
        return False


def test_an_end_that_stands_still_says_where_and_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a recorder that hangs beyond all patience; the limit is lowered for the test."""
    program = (
        "import sys, time; from pneuarm.service.daemon import supervisor\n"
        "supervisor.LAST_RESORT_S = 1.0\n"
        "def stand_still(self, patience_s): time.sleep(1000.0)\n"
        "supervisor.Child.join = stand_still\n"
        "sys.argv = ['pneuarm', 'run', sys.argv[1]]\n"
        "if __name__ == '__main__': from pneuarm.__main__ import main; main()\n"
    )
    daemon = Daemon(tmp_path)
    script = tmp_path / "standing_still.py"
    script.write_text(program)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    with (tmp_path / "said.txt").open("wb") as said:
        process = subprocess.Popen(
            [sys.executable, str(script), str(daemon.config)],
            stdout=said,
            stderr=said,
            process_group=0,
        )
    daemon.process = process
    try:
        output = tmp_path / "said.txt"
        wait_for(lambda: "is ready" in output.read_text(), "the start")
        process.send_signal(signal.SIGTERM)
        assert process.wait(20) == 1
        assert "stand_still" in output.read_text()
        wait_for(lambda: not daemon._running(), "the end of the others")
    finally:
        daemon.kill()


def test_the_last_resort_comes_after_all_patience() -> None:
    patience_s = supervisor._END_S + sum(
        supervisor.Supervisor._patience_s(name) + 2.0
        for name in ("device", "gateway", "recorder", "viewer")
    )
    assert patience_s < supervisor.LAST_RESORT_S

"""However `pneuarm demo` ends, nothing that it has started outlives it."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tools.rig.daemon import ROOT, wait_for
from tools.rig.processes import processes


def of_show(folder: Path) -> list[str]:
    """Command lines of all living processes that were started for this show."""
    mark = f"TMPDIR={folder}\0".encode()
    found = []
    for each in processes():
        try:
            environment = Path(f"/proc/{each.pid}/environ").read_bytes()
        except OSError:
            continue
        if mark in environment and each.state != "Z":
            found.append(each.command)
    return found


def begun_show(folder: Path, state: Path) -> "subprocess.Popen[bytes]":
    """Start a show and wait until all that it consists of runs.

    On a machine that is too busy for its daemon a show ends by itself; then another is started.
    """
    parts = ("pneuarm emulate", "pneuarm run", "service.demo.client", "--serve-grpc")
    for _ in range(4):
        show = subprocess.Popen(
            [sys.executable, "-m", "pneuarm", "demo", "--adapter", "festo-cpx", "--seconds", "60"],
            cwd=ROOT,
            env=os.environ | {"TMPDIR": str(folder), "XDG_STATE_HOME": str(state)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        wait_for(
            lambda: show.poll() is not None or all(part in str(of_show(folder)) for part in parts),  # noqa: B023
            "all that a show consists of",
        )
        if show.poll() is None:
            return show
    pytest.fail("the show ended by itself")


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_nothing_outlives_the_demo(tmp_path: Path, ending: signal.Signals) -> None:
    if signal.getsignal(ending) == signal.SIG_IGN:
        pytest.skip("the tests run under nohup, and so does the demo")
    folder = tmp_path / "show"
    folder.mkdir()
    show = begun_show(folder, tmp_path)
    try:
        show.send_signal(ending)
        if ending != signal.SIGKILL:
            show.send_signal(ending)  # as `timeout` does, to the process and to its group
        status = show.wait(120)
        wait_for(lambda: not of_show(folder), lambda: f"the end of {of_show(folder)}")
    finally:
        show.kill()
    if ending == signal.SIGKILL:
        assert status == -signal.SIGKILL
    elif ending != signal.SIGINT:  # which may be given twice, to be obeyed at once
        assert (status, list(folder.iterdir())) == (128 + ending, [])

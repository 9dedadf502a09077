"""`pneuarm learn` as a whole: a daemon, a measured tip, the file, and the trajectory with it."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.learning.file import load
from tests.service.calibration.test_calibrate import Camera
from tools.bench.learning import circle
from tools.rig.daemon import Daemon, assert_one_sentence, wait_for

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    with Daemon(tmp_path_factory.mktemp("learn"), {"control": {"rate_hz": 250}}) as running:
        yield running


@pytest.fixture
def trajectory(tmp_path: Path) -> Path:
    path, shape = tmp_path / "circle.csv", circle(0.5, turns=0.5)
    rows = zip(shape.times_s, shape.positions_m, strict=True)
    path.write_text("".join(f"{t:.6f}, {1e3 * x}, {1e3 * y}, 200\n" for t, (x, y, _) in rows))
    return path


def test_without_a_measured_tip_nothing_moves(daemon: Daemon, trajectory: Path) -> None:
    done = daemon.command("learn", str(trajectory), "--output", str(trajectory.parent / "x.toml"))
    assert_one_sentence(done, "sensor/tip_pose", "learning", "motion capture")
    assert [path.name for path in trajectory.parent.iterdir()] == [trajectory.name]
    with daemon.client() as client:
        assert client.state().mode == pb.READY


def test_a_trajectory_is_learnt_kept_and_followed_with_what_was_learnt(
    daemon: Daemon, trajectory: Path
) -> None:
    kept = trajectory.parent / "kept.toml"
    with Camera(daemon):
        time.sleep(0.3)
        words = ("learn", str(trajectory), "--trials", "3", "--output", str(kept), "--json")
        done = daemon.command(*words)
        assert done.returncode == 0, done.stderr
        told = json.loads(done.stdout)
        assert told["file"] == str(kept)
        assert len(told["trials"]) == 3
        assert told["after"]["rms_mm"] < 0.7 * told["before"]["rms_mm"]
        assert all(f"trial {number} of 3: RMS" in done.stderr for number in (1, 2, 3))
        learned = load(kept)
        assert learned.arm == daemon.arm
        assert [row.rms_mm for row in learned.trials] == pytest.approx(
            [row["rms_mm"] for row in told["trials"]], abs=1e-3
        )
        with daemon.client() as client:
            assert client.state().mode == pb.HOLD
        words = ("send", "trajectory", str(trajectory), "--learned", str(kept), "--enable")
        sent = daemon.command(*words, "--json")
        assert sent.returncode == 0, sent.stderr
    other = trajectory.parent / "other.csv"
    other.write_text(trajectory.read_text().replace(", 200\n", ", 201\n"))
    done = daemon.command("send", "trajectory", str(other), "--learned", str(kept), "--enable")
    assert_one_sentence(done, "another trajectory", kept.name, "--learned")


def started(daemon: Daemon, trajectory: Path, kept: Path) -> tuple["subprocess.Popen[str]", str]:
    """Start a long learning; return it, and what it has said, once something is learnt."""
    command = [sys.executable, "-u", "-m", "pneuarm", "learn", str(trajectory), "--trials", "50"]
    command += ["--output", str(kept), "--arm", daemon.arm, "--connect", daemon.endpoint]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    said = ""
    while "trial 2 of 50" not in said:
        line = process.stderr.readline()
        assert line, said
        said += line
    return process, said


def ended(process: "subprocess.Popen[str]", said: str, kept: Path) -> str:
    """Wait for the end of a learning that was broken off; return all that it has said."""
    said += process.communicate(timeout=60)[1]
    assert "Traceback" not in said
    assert len(load(kept).trials) >= 2
    return said


def test_ctrl_c_leaves_the_arm_holding_and_what_was_learnt(
    daemon: Daemon, trajectory: Path
) -> None:
    kept = trajectory.parent / "kept.toml"
    with Camera(daemon):
        time.sleep(0.3)
        process, said = started(daemon, trajectory, kept)
        process.send_signal(signal.SIGINT)
        said = ended(process, said, kept)
    assert process.returncode == 130
    assert str(kept) in said
    with daemon.client() as client:
        wait_for(lambda: client.state().mode == pb.HOLD, "the hold")


def test_a_second_learning_is_refused_and_a_daemon_that_dies_ends_the_first_in_words(
    daemon: Daemon, trajectory: Path
) -> None:
    kept = trajectory.parent / "kept.toml"
    with Camera(daemon):
        time.sleep(0.3)
        process, said = started(daemon, trajectory, kept)
        second = daemon.command("learn", str(trajectory), "--output", str(kept) + ".2")
        assert_one_sentence(second, "learn@")
        assert not Path(str(kept) + ".2").exists()
    daemon.send_signal_to_all(signal.SIGKILL)
    said = ended(process, said, kept)
    assert process.returncode == 1
    assert str(kept) in said.splitlines()[-2]
    assert said.splitlines()[-1].startswith("pneuarm: ")

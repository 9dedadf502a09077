"""`pneuarm calibrate` as a whole: a daemon, a measured tip, files that the daemon takes."""

import argparse
import json
import re
import subprocess
import sys
import threading
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import (
    CalibrationError,
    ConfigurationError,
    LogError,
    ModeRefused,
)
from pneuarm.controllers.calibration.pace import Pace
from pneuarm.controllers.calibration.plan import KNOWN, Move
from pneuarm.logs.rings.tick import ticks_from_states
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import encoding_of
from pneuarm.logs.schema.topics import TIP_POSE, full_key
from pneuarm.service.calibration import broken_off, drive
from pneuarm.service.calibration import command as commands_calibrate
from pneuarm.service.calibration.drive import progress, require_tip
from pneuarm.service.calibration.files import write_whole
from pneuarm.service.calibration.recordings import recording_of, require_seen
from pneuarm.service.configuration.configuration import check, load
from tools.rig.daemon import Daemon, assert_one_sentence, run_command

pytestmark = pytest.mark.slow


class Camera:
    """Publishes the simulated arm's true tip as a motion capture would: with noise."""

    def __init__(self, daemon: Daemon) -> None:
        self._daemon, self._end = daemon, threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> "Camera":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join(10.0)

    def _run(self) -> None:
        rng = np.random.default_rng(0)
        with self._daemon.client("camera") as client:
            key = full_key(client.arm, TIP_POSE.key)
            for state in client.states():
                if self._end.is_set():
                    return
                message = pose_of(state, rng.normal(0.0, 1e-4, 3))
                client._session.put(key, message.SerializeToString(), encoding=encoding_of(message))


def pose_of(state: pb.ArmState, noise_m: np.ndarray) -> PoseInFrame:
    message = PoseInFrame(frame_id="base")
    position, orientation = message.pose.position, message.pose.orientation
    tip = np.array(state.tip_true_position_m) + noise_m
    position.x, position.y, position.z = tip.tolist()
    values = list(state.tip_true_orientation_xyzw)
    orientation.x, orientation.y, orientation.z, orientation.w = values
    return message


def few_moves(arm: Arm, pace: Pace = KNOWN) -> list[Move]:
    """Return what is just enough for a fit: a dozen rests, each a short way from the one before."""
    shares = [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (-1, 0, 0), (-1, -1, 0)]
    shares += [(0, -1, 0), (0, -1, -1), (0, 0, -1), (1, 1, 0), (1, 1, 1), (0, 0, 0)]
    return [Move(0.25e5 * np.array([share], dtype=float), 0.1, 1.15) for share in shares]


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    with Daemon(tmp_path_factory.mktemp("calibrate"), {"control": {"rate_hz": 250}}) as running:
        yield running


def arguments(folder: Path, daemon: Daemon, **changed: Any) -> argparse.Namespace:
    given = {
        "arm": daemon.arm,
        "connect": daemon.endpoint,
        "zenoh_config": "",
        "json": True,
        "out": folder,
        "from_logs": None,
        "world": False,
        "resume": False,
    }
    return argparse.Namespace(**(given | changed))


def test_without_a_measured_tip_nothing_moves(daemon: Daemon, tmp_path: Path) -> None:
    done = daemon.command("calibrate", "--out", str(tmp_path))
    assert_one_sentence(done, "sensor/tip_pose", "motion capture")
    assert list(tmp_path.iterdir()) == []
    with daemon.client() as client:
        assert client.state().mode == pb.READY


def test_an_arm_is_calibrated_and_the_daemon_takes_the_result(
    daemon: Daemon,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(commands_calibrate, "plan", few_moves)
    monkeypatch.setattr(commands_calibrate, "ask", lambda why: True)  # a busy machine stalls
    with Camera(daemon):
        time.sleep(0.3)
        assert commands_calibrate.run(arguments(tmp_path / "live", daemon)) == 0
    said = capsys.readouterr()
    told = json.loads(said.out)
    assert "50 %" in said.err
    assert told["rests"] >= 12
    assert told["error_after_mm"]["mean"] < told["error_before_mm"]["mean"] / 3.0
    assert_files(tmp_path / "live", daemon)
    with daemon.client() as client:
        assert client.state().mode in (pb.IDLE, pb.READY)
        log = Path(client.info().log_path)
    # The same again from the session that the daemon has recorded meanwhile.
    time.sleep(1.0)
    from_logs = arguments(tmp_path / "log", daemon, from_logs=[log], json=False)
    assert commands_calibrate.run(from_logs) == 0
    assert "mm" in capsys.readouterr().out
    assert_files(tmp_path / "log", daemon)
    with pytest.raises(LogError, match="'other'"):
        commands_calibrate.run(arguments(tmp_path, daemon, from_logs=[log], arm="other"))


def assert_files(folder: Path, daemon: Daemon) -> None:
    assert {path.name for path in folder.iterdir()} == {"calibration.toml", "calibration.html"}
    text = (folder / "calibration.toml").read_text()
    assert re.match(rf"# .*\b{daemon.arm}\b.*\b20\d\d-", text)
    whole = load(folder / "calibration.toml")
    assert whole.arm.name == daemon.arm
    assert whole.build_arm().sections[0].hysteresis_pa > 500.0
    assert whole.build_simulated_arm().sections == load().build_arm().sections
    assert whole.zenoh.listen == (daemon.endpoint,)
    page = (folder / "calibration.html").read_text()
    assert page.count("data:image/png;base64,") >= 3
    # Four letters may stand in a picture's text by chance.
    assert "http" not in re.sub(r"base64,[^\"]*", "", page)
    assert "rest_length_mm" in page


def test_ctrl_c_leaves_the_arm_vented_and_no_file(daemon: Daemon, tmp_path: Path) -> None:
    with Camera(daemon):
        time.sleep(0.3)
        command = [sys.executable, "-m", "pneuarm", "calibrate", "--out", str(tmp_path)]
        command += ["--arm", daemon.arm, "--connect", daemon.endpoint]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        with daemon.client() as client:
            while client.state().mode != pb.ACTIVE:
                assert process.poll() is None
                time.sleep(0.02)
            time.sleep(0.5)
            process.send_signal(2)
            _, said = process.communicate(timeout=20)
            assert process.returncode == 130
            assert "Traceback" not in said
            assert client.state().mode in (pb.IDLE, pb.READY)
            assert np.abs(list(client.state().pressure_sent_pa)).max() == 0.0
    assert list(tmp_path.iterdir()) == []


def test_a_stop_in_the_middle_ends_it_without_the_word(daemon: Daemon) -> None:
    asked: list[str] = []

    def stop(elapsed_s: float, whole_s: float) -> None:
        if elapsed_s > 0.3:
            with daemon.client("other") as other:
                other.hold()

    def no(why: str) -> bool:
        asked.append(why)
        return False

    with Camera(daemon), daemon.client() as client:
        time.sleep(0.3)
        with pytest.raises(ModeRefused, match="mode hold"):
            drive.record(client, few_moves(load().build_arm()), load(), stop, no)
        assert client.state().mode in (pb.IDLE, pb.READY)
    assert len(asked) == 1


def test_a_stall_holds_names_its_cause_and_goes_on_by_the_word(
    daemon: Daemon, tmp_path: Path
) -> None:
    asked, stalled = list[str](), list[float]()
    moves = few_moves(load().build_arm())[:3]

    def stall(elapsed_s: float, whole_s: float) -> None:
        if elapsed_s > 1.6 and not stalled:
            stalled.append(elapsed_s)
            time.sleep(5.5)  # beyond the target timeout of this daemon

    def word(why: str) -> bool:
        asked.append(why)
        return True

    so_far = drive.Progressed()
    with Camera(daemon), daemon.client() as client:
        time.sleep(0.3)
        drive.record(client, moves, load(), stall, word, so_far)
        configuration = check(tomllib.loads(client.info().config_toml))
    assert any("target_stale" in why for why in asked), asked
    assert so_far.moves_done == len(moves)
    assert len(so_far.pieces) >= 2
    # What was kept goes on where it was, and only with the same arm.
    broken_off.save(tmp_path, configuration, so_far)
    again = broken_off.load(tmp_path, configuration)
    assert again.moves_done == len(moves)
    np.testing.assert_array_equal(again.recording.sent_pa, so_far.recording.sent_pa)
    with pytest.raises(CalibrationError, match="another"):
        broken_off.load(tmp_path, load(preset="table1"))
    (tmp_path / broken_off.NAME).write_bytes(b"no archive")
    with pytest.raises(CalibrationError, match="damaged"):
        broken_off.load(tmp_path, configuration)
    broken_off.remove(tmp_path)
    with pytest.raises(CalibrationError, match="--resume"):
        broken_off.load(tmp_path, configuration)


def state_at(age_s: float, tip: tuple[float, ...] = (0.0, 0.0, 0.2)) -> pb.ArmState:
    return pb.ArmState(
        n_sections=1, mode=pb.ACTIVE, tip_measured_position_m=tip, tip_measured_age_s=age_s
    )


@pytest.mark.parametrize("state", [state_at(1.5), state_at(0.0, ())])
def test_a_tip_that_is_old_or_missing_counts_as_not_measured(state: pb.ArmState) -> None:
    client: Any = SimpleNamespace(arm="paper", state=lambda: state)
    with pytest.raises(CalibrationError, match="emulate camera"):
        require_tip(client)


def test_a_tip_is_put_where_it_was_received_and_mostly_there() -> None:
    states = []
    for index in range(200):  # 1000 a second, each pose 20 ms old
        state = state_at(0.02, (1e-3 * index, 0.0, 0.2))
        state.time_unix_ns = 5_000_000_000 + index * 1_000_000
        state.pressure_sent_pa.extend([0.0] * 3)
        states.append(state)
    recording = recording_of(ticks_from_states(states, 1))
    assert len(recording.time_s) == 20
    np.testing.assert_allclose(recording.tip_m[5, 0], 0.07, atol=1e-9)
    require_seen(recording)
    for state in states[100:]:
        state.tip_measured_age_s = 0.5
    with pytest.raises(CalibrationError, match="50 %"):
        require_seen(recording_of(ticks_from_states(states, 1)))


def test_what_is_no_log_and_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    missing = tmp_path / "no.mcap"
    done = run_command("calibrate", "--from", str(missing), "--out", str(tmp_path / "out"))
    assert_one_sentence(done, str(missing))
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigurationError, match=r"calibration\.toml"):
        write_whole(tmp_path / "file" / "calibration.toml", "")


def test_progress_is_plain_lines_where_there_is_no_terminal(
    capsys: pytest.CaptureFixture[str],
) -> None:
    tell = progress()
    for elapsed_s in np.linspace(0.0, 100.0, 1000):
        tell(float(elapsed_s), 100.0)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 11
    assert re.search(r"\b0 %.*\b100 s", lines[0])
    assert re.search(r"\b100 %.*\b0 s", lines[-1])

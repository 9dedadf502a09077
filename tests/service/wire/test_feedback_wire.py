"""Shapes and measured tips over the wire, with a real daemon and the camera program."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pneuarm.controllers.arm.errors import TargetRejected
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.target_messages import circle_target, trajectory_target
from tools.rig.daemon import ROOT, Daemon, run_command, wait_for, wait_for_event


def position(values: object) -> np.ndarray:
    return np.array(list(values))  # type: ignore[call-overload]


def test_the_camera_program_takes_the_tip_to_its_target_and_is_missed(tmp_path: Path) -> None:
    with Daemon(tmp_path) as daemon, daemon.client() as client:
        camera = subprocess.Popen(
            [
                *(sys.executable, "-m", "pneuarm", "emulate", "camera"),
                *("--arm", daemon.arm, "--connect", daemon.endpoint),
            ],
            cwd=ROOT,
        )
        try:
            wait_for(
                lambda: client.state().tip_estimated_source == pb.FROM_TIP_POSE, "the camera", 60.0
            )
            client.enable()
            state = client.move_to((0.03, 0.0, 0.2), timeout_s=30.0)
            assert state.reach == pb.REACHED
            target, true = position((0.03, 0.0, 0.2)), position(state.tip_true_position_m)
            assert np.linalg.norm(true - target) < 2e-3  # without it: more than 15 mm
            assert np.linalg.norm(position(state.tip_model_position_m) - true) > 5e-3
            assert 0.0 < state.tip_estimated_sigma_m < 5e-3
        finally:
            camera.terminate()
            camera.wait(10)
        wait_for(lambda: client.state().tip_estimated_source == pb.FROM_PRESSURES, "the loss")
        wait_for_event(client, "camera_lost")


def test_shapes_run_to_their_end_and_bad_ones_are_refused(tmp_path: Path) -> None:
    with Daemon(tmp_path) as daemon, daemon.client() as client:
        client.enable()
        circle = circle_target((0.0, 0.0, 0.2), 0.02, 1.0, turns=1.0)
        first = client.state().sequence
        state = client.wait_until_reached(circle, 30.0)
        assert state.target_kind == pb.CIRCLE
        assert state.reach == pb.REACHED
        assert position(state.reference_position_m) == pytest.approx([0.02, 0.0, 0.2], abs=1e-6)
        assert state.sequence - first > 1000  # it took its second
        far = trajectory_target([(1.0, (0.0, 0.0, 0.2)), (2.0, (0.3, 0.0, 0.1))])
        with pytest.raises(TargetRejected, match=r"waypoint 2 at \(300.0, 0.0, 100.0\) mm is out"):
            client.wait_until_reached(far, 10.0)
        with pytest.raises(TargetRejected, match="needs 1257 mm/s along an axis"):
            client.wait_until_reached(circle_target((0.0, 0.0, 0.2), 0.02, 10.0), 10.0)


def test_a_file_of_waypoints_is_sent(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("# time x y z\n0.5, 0, 0, 200\n1.0, 20, 0, 200\n1.5 20 20 195\n")
    with Daemon(tmp_path) as daemon:
        connection = ("--arm", daemon.arm, "--connect", daemon.endpoint)
        done = run_command("send", "trajectory", str(path), "--enable", "--json", *connection)
        assert done.returncode == 0, done.stderr
        assert '"TRAJECTORY"' in done.stdout
        assert '"REACHED"' in done.stdout
        path.write_text("0 1 2\n")
        done = run_command("send", "trajectory", str(path), *connection)
        assert done.returncode == 1
        assert "line 1: '0 1 2'; four numbers are needed" in done.stderr


def test_the_longest_trajectory_runs_and_is_logged_whole(tmp_path: Path) -> None:
    waypoints = [(0.1 + 0.015 * n, (5e-5 * n, 0.0, 0.2)) for n in range(200)]
    target = trajectory_target(waypoints)
    with Daemon(tmp_path) as daemon:
        with daemon.client() as client:
            client.enable()
            state = client.wait_until_reached(target, 30.0)
            assert state.target_kind == pb.TRAJECTORY
            assert state.reach == pb.REACHED
        daemon.stop()
        messages = [entry.message for entry in daemon.log()]
    found = [message for message in messages if isinstance(message, pb.Target)]
    assert found
    assert all(message.trajectory == target.trajectory for message in found)

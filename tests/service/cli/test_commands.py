"""The commands by hand, as real processes against a real daemon."""

import json
import math
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.client import Client
from tools.rig.daemon import PATIENCE_S, ROOT, Daemon, assert_one_sentence, wait_for


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    with Daemon(tmp_path_factory.mktemp("commands")) as daemon:
        yield daemon


@pytest.fixture
def watcher(daemon: Daemon) -> Iterator[Client]:
    """A client that looks on, with the arm empty and ready before each test."""
    with daemon.client("watcher") as client:
        if client.state().mode == pb.ESTOP:
            client.reset()
        client.vent()
        wait_for(lambda: client.state().mode == pb.READY, "an empty arm")
        yield client


TARGETS = {
    "position": ("20", "-10", "210"),
    "pose": ("0", "0", "210", "0", "0", "0", "1"),
    "twist": ("10", "0", "-5.5", "--seconds", "0.3", "--frame", "tip"),
    "lengths": ("205", "210", "200"),
    "pressures": ("0.05", "-0.05", "0.1"),
}


@pytest.mark.parametrize("kind", TARGETS)
def test_send_moves_and_leaves_the_arm_holding(daemon: Daemon, watcher: Client, kind: str) -> None:
    done = daemon.command("send", kind, *TARGETS[kind], "--enable", "--json")
    assert done.returncode == 0, done.stderr
    state = json.loads(done.stdout)
    assert state["target_kind"] == kind.upper()
    assert state["mode"] == "ACTIVE"
    if kind != "twist":
        assert state["reach"] == "REACHED"
    wait_for(lambda: watcher.state().mode == pb.HOLD, "the arm to hold")
    if kind == "position":
        there = watcher.state().tip_estimated_position_m
        assert math.dist(there, (0.02, -0.01, 0.21)) < 5e-3
    if kind == "pressures":
        sent = list(watcher.state().pressure_sent_pa)
        assert sent == pytest.approx([5e3, -5e3, 1e4], abs=1.0)


def test_send_says_what_came_of_it(daemon: Daemon, watcher: Client) -> None:
    done = daemon.command("send", "position", "0", "0", "210", "--enable", "--law", "resolved_rate")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("reached: tip at (")
    assert done.stdout.endswith("; the arm holds\n")
    away = daemon.command("send", "position", "0", "0", "350", "--enable")
    assert away.returncode == 2
    assert "out of reach" in away.stdout
    assert "Eq. (4)" in away.stdout
    assert "mm away" in away.stdout
    assert away.stderr == ""


def test_send_without_arming_is_refused(daemon: Daemon, watcher: Client) -> None:
    done = daemon.command("send", "position", "20", "0", "210")
    assert_one_sentence(done, "mode ready", "--enable")
    assert watcher.state().mode == pb.READY


def test_enable_then_send(daemon: Daemon, watcher: Client) -> None:
    done = daemon.command("enable")
    assert (done.returncode, done.stdout) == (0, "mode is active\n"), done.stderr
    sent = daemon.command("send", "position", "10", "0", "210")
    assert sent.returncode == 0, sent.stderr
    assert sent.stdout.startswith("reached")


@pytest.mark.parametrize(
    ("command", "after"), [("enable", "ACTIVE"), ("hold", "HOLD"), ("vent", "IDLE")]
)
def test_modes_as_json(daemon: Daemon, watcher: Client, command: str, after: str) -> None:
    if command != "enable":
        watcher.enable()
        watcher.release()
    done = daemon.command(command, "--json")
    assert done.returncode == 0, done.stderr
    reply = json.loads(done.stdout)
    assert reply["accepted"] is True
    assert reply["mode"] == after


def test_stop_and_reset(daemon: Daemon, watcher: Client) -> None:
    watcher.enable()
    watcher.release()
    done = daemon.command("estop")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"STOPPED: arm {daemon.arm} vents, confirmed on this machine")
    wait_for(lambda: watcher.state().mode == pb.ESTOP, "the stop")
    assert_one_sentence(daemon.command("enable"), "emergency stop is latched", "reset")
    reset = daemon.command("reset")
    assert (reset.returncode, reset.stdout) == (0, "mode is idle\n")
    assert_one_sentence(daemon.command("reset"), "reset")


def test_state_for_people_and_for_programs(daemon: Daemon, watcher: Client) -> None:
    done = daemon.command("state")
    assert done.returncode == 0
    assert len(done.stdout.splitlines()) == 1
    for word in ("#", "ready", "tip (", " mm", " bar"):
        assert word in done.stdout
    state = json.loads(daemon.command("state", "--json").stdout)
    assert state["mode"] == "READY"
    assert len(state["pressure_measured_pa"]) == 3


@pytest.mark.parametrize("json_wanted", [True, False])
def test_state_follow_goes_on_until_ctrl_c(
    daemon: Daemon, watcher: Client, json_wanted: bool
) -> None:
    options = ["--json"] if json_wanted else []
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "pneuarm", "state", "--follow", *options),
            *("--arm", daemon.arm, "--connect", daemon.endpoint),
        ],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        lines = [process.stdout.readline() for _ in range(5)]
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE_S)
    finally:
        process.kill()
    assert process.returncode == 130
    assert errors == ""
    if json_wanted:
        numbers = [int(json.loads(line)["sequence"]) for line in lines]
    else:
        numbers = [int(line.split()[0].removeprefix("#")) for line in lines]
    assert numbers == sorted(set(numbers))


REFUSED = {
    "millimetres": (("position", "20000", "0", "210"), "is it in mm?"),
    "not a number": (("position", "nan", "0", "210"), "finite"),
    "too few chambers": (("lengths", "200", "200"), "2 values; arm"),
    "too long": (("lengths", "200", "200", "400"), "chamber 3 is 0.4 m"),
    "too much": (("pressures", "0", "0", "9"), "allowed: -90000 to 90000 Pa"),
    "no unit quaternion": (("pose", "0", "0", "200", "0", "0", "0", "2"), "unit quaternion"),
    "fast": (("twist", "90000", "0", "0"), "is it in mm/s?"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_send_tells_why_a_target_is_refused(daemon: Daemon, watcher: Client, name: str) -> None:
    arguments, words = REFUSED[name]
    assert_one_sentence(daemon.command("send", *arguments, "--enable"), words)


def test_command_refused_while_another_holds_the_arm(daemon: Daemon, watcher: Client) -> None:
    watcher.take_lease()
    try:
        assert_one_sentence(daemon.command("enable"), watcher.client_id, "--take-over")
    finally:
        watcher.release()


@pytest.mark.parametrize(
    "command", [("state",), ("send", "position", "0", "0", "200"), ("hold",), ("estop",)]
)
def test_nobody_there_is_one_sentence(command: tuple[str, ...]) -> None:
    nobody = Daemon.__new__(Daemon)
    nobody.arm, nobody.endpoint = "nobody", "tcp/127.0.0.1:1"
    done = nobody.command(*command)
    assert_one_sentence(done, "tcp/127.0.0.1:1", "nobody")

"""`info`, `replay` and `config` as real processes, on a log that a real daemon has written."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from errno import ENOENT
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from pneuarm.controllers.arm.errors import DaemonUnreachable
from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import full_key
from pneuarm.service.network.sessions import open_connected
from tools.rig.daemon import (
    ROOT,
    Daemon,
    arm,
    assert_one_sentence,
    enough,
    free_port,
    keep_moving,
    run_command,
    wait_for,
)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> LogReader:
    """Return a session of some seconds with a movement, closed properly."""
    with Daemon(tmp_path_factory.mktemp("log")) as daemon, daemon.client() as client:
        arm(client)
        keep_moving(client, enough(2.0), "two seconds of movement")
    return daemon.log()


@pytest.fixture
def command() -> Iterator["list[subprocess.Popen[str]]"]:
    """Processes that the test has started; ended after it, however it ended."""
    processes: list[subprocess.Popen[str]] = []
    yield processes
    for process in processes:
        process.kill()
        process.communicate()


def start(command: "list[subprocess.Popen[str]]", *arguments: str) -> "subprocess.Popen[str]":
    process = subprocess.Popen(
        [sys.executable, "-m", "pneuarm", *arguments],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    command.append(process)
    return process


def interrupt(process: "subprocess.Popen[str]") -> str:
    """Press Ctrl-C; return what it has said."""
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert errors == ""
    return output


def test_info_says_what_is_in_it(log: LogReader) -> None:
    path = str(log.parts[0])
    found = json.loads(run_command("info", path, "--json").stdout)
    ticks = log.ticks()
    assert found["path"] == path
    assert found["arm"] == log.info.arm
    assert found["finished"] is True
    assert found["ticks"] == len(ticks)
    assert found["missing_ticks"] == 0
    assert found["messages"]["state"] == len(ticks)
    assert found["messages"]["cmd/target"] > 10
    assert found["size_bytes"] == Path(path).stat().st_size
    text = run_command("info", path).stdout
    assert path in text
    assert re.search(rf"^ticks +{len(ticks)}\b.*\b0$", text, re.M)


def replayed(subscriber: Any) -> pb.ArmState:
    """Return the next state that is replayed."""
    sample = wait_for(subscriber.try_recv, "a replayed state")
    return pb.ArmState.FromString(sample.payload.to_bytes())


def test_replay_over_zenoh_gives_the_recorded_states_in_order(
    log: LogReader, command: "list[subprocess.Popen[str]]"
) -> None:
    recorded = {e.message.sequence: e.message for e in log if isinstance(e.message, pb.ArmState)}
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    process = start(
        command,
        *("replay", str(log.parts[0]), "--to", "zenoh"),
        *("--speed", "20", "--loop", "--listen", endpoint),
    )

    def connect() -> object:
        assert process.poll() is None, process.communicate()
        try:
            return open_connected(endpoint)
        except DaemonUnreachable:
            return None

    session = wait_for(connect, "the replay's address")
    try:
        subscriber = session.declare_subscriber(full_key(log.info.arm, "state"))
        states = [replayed(subscriber)]
        while len(states) < 50 or states[-1].sequence > states[-2].sequence:
            states.append(replayed(subscriber))
        states += [replayed(subscriber) for _ in range(50)]  # the log has begun again
        alive = session.liveliness().get(full_key(log.info.arm, "alive/daemon"), timeout=3.0)
        assert len(list(alive)) == 1
        refused = list(session.get(full_key(log.info.arm, "cmd/mode"), payload=b"", timeout=1.0))
        assert not [reply for reply in refused if reply.ok is not None]
    finally:
        session.close()
    assert all(state == recorded[state.sequence] for state in states)
    ends = [a.sequence for a, b in pairwise(states) if b.sequence <= a.sequence]
    assert len(ends) == 1, "in order, but for where the log begins again"
    assert ends[0] > len(recorded) - 100
    assert endpoint in interrupt(process)


def test_replay_over_zenoh_ends_with_the_log(log: LogReader) -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    done = run_command(
        "replay", str(log.parts[0]), "--to", "zenoh", "--speed", "50", "--listen", endpoint
    )
    assert done.returncode == 0
    assert done.stderr == ""


def test_replay_in_rerun_serves_until_ctrl_c(
    log: LogReader, command: "list[subprocess.Popen[str]]"
) -> None:
    port = free_port()
    process = start(command, "replay", str(log.parts[0]), "--speed", "20", "--port", str(port))

    def listens() -> bool:
        assert process.poll() is None, process.communicate()
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", port)) == 0

    wait_for(listens, "Rerun's server")
    assert process.stdout is not None
    lines = [process.stdout.readline() for _ in range(2)]
    assert f"rerun --connect rerun+http://127.0.0.1:{port}/proxy" in lines[0]
    assert "Ctrl-C" in lines[1]
    interrupt(process)
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", port)) != 0


def test_config_shows_what_gives_the_same_again(tmp_path: Path) -> None:
    shown = run_command("config", "show", "--arm", "trunk")
    assert shown.returncode == 0
    assert len(tomllib.loads(shown.stdout)["arm"]["sections"]) == 3
    path = tmp_path / "trunk.toml"
    path.write_text(shown.stdout)
    assert run_command("config", "show", str(path)).stdout == shown.stdout
    checked = run_command("config", "check", str(path))
    assert checked.returncode == 0
    assert checked.stdout.startswith(str(path))
    assert all(fact in checked.stdout for fact in ("trunk", "9 chambers", "500 Hz"))


@pytest.mark.parametrize("command", ["info", "replay"])
def test_what_is_no_log_is_one_sentence(tmp_path: Path, command: str) -> None:
    text = tmp_path / "notes.mcap"
    text.write_text("no MCAP at all\n")
    assert_one_sentence(run_command(command, str(text)), str(text), "MCAP")
    absent = tmp_path / "absent.mcap"
    assert_one_sentence(run_command(command, str(absent)), str(absent), os.strerror(ENOENT))
    assert_one_sentence(run_command(command, str(tmp_path)), str(tmp_path))


def test_replay_refuses_a_speed_of_nothing_and_a_port_that_is_taken(log: LogReader) -> None:
    path = str(log.parts[0])
    assert_one_sentence(run_command("replay", path, "--speed", "0"), "--speed", "0")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        words = f"127.0.0.1:{port}"
        assert_one_sentence(run_command("replay", path, "--port", str(port)), "--port", words)
        listen = f"tcp/127.0.0.1:{port}"
        done = run_command("replay", path, "--to", "zenoh", "--listen", listen)
        assert_one_sentence(done, "--listen", words)

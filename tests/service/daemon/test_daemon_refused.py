"""What the daemon refuses at its start: one sentence, status 1, and nothing was touched."""

import os
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from tools.rig.daemon import ROOT, Daemon, assert_one_sentence, free_port, run_command

Tables = dict[str, dict[str, Any]]


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    tables = {"hardware": {"device": f"bench-{free_port()}"}}
    with Daemon(tmp_path_factory.mktemp("first"), tables) as daemon:
        yield daemon


@pytest.fixture
def taken_port() -> Iterator[int]:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        yield taken.getsockname()[1]


def check_refused(folder: Path, tables: Tables, *words: str) -> None:
    """Run a daemon that must not start, and `config check` on the same file where that applies."""
    daemon = Daemon(folder, tables)
    assert_one_sentence(run_command("run", str(daemon.config)), *words)
    assert not daemon.logs.exists() or list(daemon.logs.iterdir()) == []


SECTION = {
    "rest_length_mm": 200.0,
    "chamber_offset_mm": 38.0,
    "length_min_mm": 100.0,
    "length_max_mm": 300.0,
    "bend_max_deg": 150.0,
    "length_rate_max_mm_s": 200.0,
    "length_acceleration_max_mm_s2": 4000.0,
    "pressure_min_bar": -0.9,
    "pressure_max_bar": 0.9,
    "pressure_slew_max_bar_s": 4.0,
    "lengthening_mm_per_bar": 113.0,
}

WRONG: dict[str, tuple[Tables, tuple[str, ...]]] = {
    "unknown key": (
        {"control": {"rate": 100.0}},
        ("control.rate: no such key", "rate_hz"),
    ),
    "unknown table": ({"valves": {"x": 1}}, ("valves: no such key", "hardware")),
    "unknown adapter": (
        {"hardware": {"adapter": "festo_vtem"}},
        ("hardware.adapter = 'festo_vtem'", "simulator"),
    ),
    "bound out of order": (
        {"arm": {"sections": [SECTION | {"length_min_mm": 250.0}]}},
        ("arm.sections[0]", "length_min_mm = 250", "must increase in this order"),
    ),
    "out of bounds": ({"control": {"rate_hz": 5.0}}, ("control.rate_hz = 5.0", "50")),
    "not finite": ({"control": {"gain_per_s": float("nan")}}, ("control.gain_per_s = nan",)),
    "wrong type": ({"control": {"rate_hz": "fast"}}, ("control.rate_hz = 'fast'",)),
    "bad name": ({"arm": {"name": "My Arm"}}, ("arm.name = 'My Arm'",)),
    "endpoint": ({"zenoh": {"listen": ["127.0.0.1"]}}, ("zenoh.listen[0]", "'127.0.0.1'", "tcp/")),
    "no Zenoh file": (
        {"zenoh": {"config_file": "/nowhere/zenoh.json5"}},
        ("zenoh.config_file = '/nowhere/zenoh.json5'", "no such file"),
    ),
    "no directory": ({"log": {"directory": "/proc/pneuarm"}}, ("log.directory", "/proc/pneuarm")),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_configuration(tmp_path: Path, name: str) -> None:
    tables, words = WRONG[name]
    check_refused(tmp_path, tables, *words)


def test_several_mistakes_are_all_told(tmp_path: Path) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text(tomli_w.dumps({"control": {"rate_hz": 1.0, "speed": 2}}))
    done = run_command("config", "check", str(path))
    assert done.returncode == 1
    assert [line for line in done.stderr.splitlines() if "control.rate_hz = 1.0" in line]
    assert [line for line in done.stderr.splitlines() if "control.speed: no such key" in line]


@pytest.mark.parametrize(("text", "fact"), [("[arm\nname = 1", "TOML"), ("\xff\xfe", "UTF-8")])
def test_file_that_is_not_toml(tmp_path: Path, text: str, fact: str) -> None:
    path = tmp_path / "wrong.toml"
    path.write_bytes(text.encode("latin-1"))
    for command in (("run",), ("config", "check"), ("config", "show")):
        assert_one_sentence(run_command(*command, str(path)), str(path), fact)


def test_file_that_is_not_there(tmp_path: Path) -> None:
    path = str(tmp_path / "absent.toml")
    assert_one_sentence(run_command("run", path), path, "No such file")


def test_second_daemon_for_the_same_arm(tmp_path: Path, daemon: Daemon) -> None:
    check_refused(
        tmp_path,
        {"arm": {"name": daemon.arm}},
        f"arm '{daemon.arm}' is in use by another pneuarm daemon (process {daemon.pid})",
    )
    with daemon.client() as client:
        client.state()


def test_same_device_under_another_name(tmp_path: Path, daemon: Daemon) -> None:
    with daemon.client() as client:
        device = client.info().config_toml.split('device = "')[1].split('"')[0]
    check_refused(
        tmp_path,
        {"hardware": {"device": device}},
        f"device 'simulator:{device}' is in use by another pneuarm daemon (process {daemon.pid})",
    )


_BROKEN = """
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.simulator.adapter import SimulatedArm

def read(self, time_s):
    raise HardwareError("the cable is out")

SimulatedArm.read = read
"""


def test_device_that_fails_before_the_first_tick(tmp_path: Path) -> None:
    hook = tmp_path / "hook"
    hook.mkdir()
    (hook / "sitecustomize.py").write_text(_BROKEN)  # every Python imports it at its start
    environment = os.environ | {"PYTHONPATH": f"{hook}:{ROOT}"}
    daemon = Daemon(tmp_path)
    done = run_command("run", str(daemon.config), env=environment)
    assert_one_sentence(done, "control process ended at its start: the cable is out")
    assert list(daemon.logs.iterdir()) == []  # nothing else was started


def test_zenoh_port_that_is_taken(tmp_path: Path, taken_port: int) -> None:
    check_refused(
        tmp_path,
        {"zenoh": {"listen": [f"tcp/127.0.0.1:{taken_port}"]}},
        f"zenoh.listen: 127.0.0.1:{taken_port} cannot be used",
        "another",
    )


def test_rerun_port_that_is_taken(tmp_path: Path, taken_port: int) -> None:
    check_refused(
        tmp_path,
        {"rerun": {"enabled": True, "port": taken_port}},
        f"rerun.port: 127.0.0.1:{taken_port} cannot be used",
        "another",
    )

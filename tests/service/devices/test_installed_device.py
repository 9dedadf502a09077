"""A device of another package: installed for real, and used like one of ours."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pneuarm.logs.schema import pneuarm_pb2 as pb
from tools.rig.daemon import (
    ROOT,
    Daemon,
    arm,
    assert_one_sentence,
    enough,
    keep_moving,
    run_command,
    wait_for,
)
from tools.rig.emulators import Emulator

EXAMPLE = ROOT / "examples" / "device"


@pytest.fixture(scope="module", autouse=True)
def installed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The example, and beside it a package whose device cannot be loaded, for all processes."""
    source, place = tmp_path_factory.mktemp("source") / "device", tmp_path_factory.mktemp("place")
    shutil.copytree(EXAMPLE, source)
    pip = ["pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([sys.executable, "-m", *pip, "--target", str(place), str(source)], check=True)
    broken = place / "broken_lab-1.0.dist-info"
    broken.mkdir()
    (broken / "METADATA").write_text("Metadata-Version: 2.1\nName: broken-lab\nVersion: 1.0\n")
    (broken / "entry_points.txt").write_text("[pneuarm.devices]\nbroken-box = nowhere.at_all:X\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join((str(place), str(ROOT))))
        yield place


@pytest.mark.timeout(300)  # a whole suite, also on a busy machine
def test_it_keeps_the_contract() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-v", "-p", "no:cacheprovider", EXAMPLE / "tests"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=280,
    )
    assert done.returncode == 0, done.stdout
    assert " passed" in done.stdout
    assert "skipped" not in done.stdout


def test_it_is_configured_like_any_other(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text('[hardware]\nadapter = "valve-box"\n[valve_box]\nhost = "10.9.8.7"\n')
    shown = run_command("config", "show", str(path))
    assert "[valve_box]" in shown.stdout
    assert 'host = "10.9.8.7"' in shown.stdout
    assert "[valve_box]" not in run_command("config", "show").stdout
    path.write_text('[hardware]\nadapter = "valve-box"\n[valve_box]\nhsot = "10.9.8.7"\n')
    assert_one_sentence(run_command("config", "check", str(path)), "valve_box.hsot", "host")
    path.write_text('[hardware]\nadapter = "valve-box"\n')
    assert_one_sentence(run_command("config", "check", str(path)), "valve_box.host")


def test_a_broken_device_is_told_where_it_is_used_and_is_in_nobodys_way(tmp_path: Path) -> None:
    assert run_command("config", "check").returncode == 0
    path = tmp_path / "own.toml"
    facts = ("broken-box", "broken-lab", "nowhere")
    path.write_text('[hardware]\nadapter = "broken-box"\n')
    assert_one_sentence(run_command("config", "check", str(path)), "hardware.adapter", *facts)
    path.write_text('[broken_box]\nhost = "10.9.8.7"\n')
    assert_one_sentence(run_command("config", "check", str(path)), "broken_box", *facts)
    assert "broken-box" not in run_command("emulate", "--help").stdout


def test_a_daemon_moves_it_stops_it_and_has_it_for_itself(tmp_path: Path) -> None:
    with Emulator("valve-box", tmp_path) as emulator:
        with Daemon(tmp_path, emulator.tables) as daemon, daemon.client() as client:
            assert "broken-lab" in daemon.output()
            arm(client)
            keep_moving(client, enough(0.5), "some movement")
            assert emulator.zero_since() is None
            client.estop()
            wait_for(emulator.zero_since, "zeros at the box")
            assert client.state().mode == pb.ESTOP
            other = Daemon(tmp_path, emulator.tables)
            refused = run_command("run", str(other.config))
            address = "tcp/127.0.0.1:{port}".format(**emulator.tables["valve_box"])
            assert_one_sentence(refused, address, str(daemon.pid))
        told = json.loads(run_command("doctor", str(daemon.config), "--json").stdout)
        findings = {finding["check"]: finding for finding in told["findings"]}
        assert findings["device"]["verdict"] == "ok"
        assert str(emulator.tables["valve_box"]["port"]) in findings["device"]["text"]
        assert findings["configuration"]["verdict"] == "warning"
        assert "broken-lab" in findings["configuration"]["text"]

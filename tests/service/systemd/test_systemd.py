"""The unit file: systemd understands it, and it says what the daemon's end and rights need."""

import configparser
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.service.configuration.configuration import load
from pneuarm.service.systemd.unit import unit_text
from tools.rig.daemon import run_command


def parsed(text: str) -> configparser.ConfigParser:
    """The unit file as sections and keys; no key of ours stands twice but DeviceAllow."""
    parser = configparser.ConfigParser(interpolation=None, delimiters="=", strict=True)
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    parser.read_string(text)
    return parser


def with_device(path: str) -> str:
    """Unit of an arm on a serial line whose sessions have a folder of their own."""
    configuration = load()
    hardware = configuration.hardware.model_copy(update={"adapter": "ctrl-p"})
    port = configuration.ctrl_p.model_copy(update={"device": path})
    log = configuration.log.model_copy(update={"directory": "/data/arm sessions"})
    changed = configuration.model_copy(update={"hardware": hardware, "ctrl_p": port, "log": log})
    return unit_text(changed, Path("/etc/pneuarm/100 % $lab.toml"), "ada")


def test_the_unit_has_what_the_watchdog_the_end_and_real_time_need() -> None:
    unit = parsed(unit_text(load(), None, "ada"))
    service = unit["Service"]
    assert shlex.split(service["ExecStart"]) == [
        *(sys.executable, "-m", "pneuarm", "run"),
        *("--arm", "paper"),
    ]
    assert service["User"] == "ada"
    assert service["Type"] == "notify"
    assert float(service["WatchdogSec"]) > 0
    # Control must outlive a dead supervisor, to vent.
    assert service["KillMode"] == "process"
    assert int(service["LimitRTPRIO"]) >= load().control.priority
    assert service["LimitMEMLOCK"] == "infinity"
    assert service["CapabilityBoundingSet"] == ""
    assert "RestrictRealtime" not in service
    assert {"AF_UNIX", "AF_INET"} <= set(service["RestrictAddressFamilies"].split())
    assert "DeviceAllow" not in service


def test_the_unit_stops_later_than_the_daemon_may_take() -> None:
    from pneuarm.service.daemon import supervisor

    service = parsed(unit_text(load(), None, "ada"))["Service"]
    assert int(service["TimeoutStopSec"]) > supervisor.LAST_RESORT_S
    assert int(service["TimeoutStartSec"]) > supervisor._FIRST_TICK_S


def test_a_device_file_a_folder_and_odd_names_get_into_the_unit() -> None:
    service = parsed(with_device("/dev/null"))["Service"]
    assert service["DeviceAllow"] == "/dev/null rw"
    assert service["SupplementaryGroups"]
    assert service["ReadWritePaths"] == '"-/data/arm sessions"'
    assert service["ExecStart"].endswith('run "/etc/pneuarm/100 %% $$lab.toml"')
    with pytest.raises(ConfigurationError, match="unit file"):
        unit_text(load(), Path("/etc/two\nlines.toml"), "ada")


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze")
@pytest.mark.parametrize("device", ["", "/dev/null"])
def test_systemd_understands_every_line(tmp_path: Path, device: str) -> None:
    path = tmp_path / "pneuarm-paper.service"
    path.write_text(with_device(device) if device else unit_text(load(), None, "root"))
    done = subprocess.run(
        ["systemd-analyze", "verify", str(path)],
        capture_output=True,
        text=True,
        timeout=30,
        env=os.environ | {"SYSTEMD_LOG_LEVEL": "warning"},
    )
    # What it says of other units of this machine is none of ours.
    assert [line for line in done.stderr.splitlines() if path.stem in line] == []


def test_the_command_prints_the_unit_and_how_to_install_it(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text('[arm]\nname = "bench"\n')
    done = run_command("systemd", str(path), "--user", "ada")
    assert done.returncode == 0
    assert done.stdout == unit_text(load(path), path, "ada")
    assert "pneuarm-bench.service" in done.stderr
    wrong = run_command("systemd", str(tmp_path / "none.toml"))
    assert wrong.returncode == 1
    assert wrong.stdout == ""

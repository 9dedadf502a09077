"""Serial devices and replayed logs by configuration: what is refused, locked and told."""

import os
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.logs.reading.replay_device import ReplayDevice
from pneuarm.service.configuration import configuration as config
from pneuarm.service.devices import registry as backends
from tests.logs.reading.test_replay_device import record


def configuration(adapter: str, accept: bool = True, **tables: Any) -> config.Configuration:
    """Return the `paper` arm, in the range of pressures that every one of these devices gives."""
    text = files("pneuarm.service.configuration").joinpath("presets", "paper.toml").read_text()
    arm = tomllib.loads(text)["arm"]
    arm["sections"][0] |= {"pressure_min_bar": 0.0, "pressure_max_bar": 0.12}
    hardware = {"adapter": adapter, "accept_no_watchdog": accept}
    return config.check({"arm": arm, "hardware": hardware, **tables})


def refusal(whole: config.Configuration) -> str:
    with pytest.raises(ConfigurationError) as raised:
        backends.check(whole)
    assert "\n" not in str(raised.value)
    return str(raised.value)


@pytest.mark.parametrize(
    ("adapter", "table", "words"),
    [
        ("ctrl-p", {}, "ctrl_p.device is missing"),
        ("ctrl-p", {"device": "x", "valves": [0, 1, 1]}, "a channel of its own"),
        ("ctrl-p", {"device": "x", "valves": [0, 1]}, "3 channels are needed"),
        ("ctrl-p", {"device": "x", "ceiling_bar": 0.1}, "ceiling_bar = 0.1 is below"),
        ("esp32", {}, "esp32.device is missing"),
        ("esp32", {"device": "x", "valves": [2, 2, 0]}, "a channel of its own"),
        ("esp32", {"device": "x", "ceiling_bar": 0.1}, "0 to 0.1 bar"),
        ("esp32", {"device": "x", "potentiometers": [[1], [2]]}, "potentiometers"),
        ("replay", {}, "replay.log is missing"),
        ("replay", {"log": "/nowhere.mcap"}, "cannot be read"),
    ],
)
def test_what_does_not_fit_is_refused_before_a_device_is_touched(
    adapter: str, table: dict[str, Any], words: str
) -> None:
    whole = configuration(adapter, **{adapter.replace("-", "_"): table})
    assert words in refusal(whole)


@pytest.mark.parametrize("adapter", ["ctrl-p", "esp32"])
def test_without_a_watchdog_it_starts_only_when_that_is_accepted(adapter: str) -> None:
    """And then the start says what stays in the arm."""
    table = {adapter.replace("-", "_"): {"device": "/dev/ttyACM0"}}
    text = refusal(configuration(adapter, accept=False, **table))
    assert "accept_no_watchdog = true" in text
    assert "keep the air in the chambers" in text
    accepted = configuration(adapter, **table)
    backends.check(accepted)
    assert "last pressures" in backends.warnings(accepted)[0]


def test_the_lock_is_on_the_port_by_whatever_link_it_is_called(tmp_path: Path) -> None:
    port, link = tmp_path / "port", tmp_path / "by-id"
    port.touch()
    os.symlink(port, link)
    addresses = {
        backends.address(configuration(adapter, **{name: {"device": str(path)}}))
        for adapter, name in (("ctrl-p", "ctrl_p"), ("esp32", "esp32"))
        for path in (port, link)
    }
    assert len(addresses) == 1


def test_a_log_takes_the_place_of_a_device(tmp_path: Path) -> None:
    """There is no air in it: it needs nobody's word about a watchdog."""
    plain = configuration("simulator")
    path = record(tmp_path / "a.mcap", plain.build_arm(), 10)
    whole = configuration("replay", accept=False, replay={"log": str(path)})
    backends.check(whole)
    assert isinstance(backends.build(whole, whole.build_arm()), ReplayDevice)

"""All kinds of device by configuration: what is refused, locked and told."""

import argparse
import ast
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pneuarm.controllers.arm.errors import AlreadyInUse, ConfigurationError
from pneuarm.hardware.device import Bus, Device, EmulatedDevice, SerialPort, TcpPort
from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.tables.table import Table
from pneuarm.logs.reading.device import ReplayConfig
from pneuarm.logs.reading.replay_device import ReplayDevice
from pneuarm.service.configuration import configuration as config
from pneuarm.service.configuration import devices as devices_module
from pneuarm.service.configuration.devices import devices
from pneuarm.service.devices import registry as backends
from pneuarm.service.processes.lock import lock
from tests.logs.reading.test_replay_device import record
from tools.rig.daemon import ROOT


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
        ("ctrl-p", {}, "ctrl_p.device"),
        ("ctrl-p", {"device": "x", "valves": [0, 1, 1]}, "valves = ["),
        ("ctrl-p", {"device": "x", "valves": [0, 1]}, "ctrl_p.valves"),
        ("ctrl-p", {"device": "x", "ceiling_bar": 0.1}, "ceiling_bar = 0.1"),
        ("esp32", {}, "esp32.device"),
        ("esp32", {"device": "x", "valves": [2, 2, 0]}, "valves = ["),
        ("esp32", {"device": "x", "ceiling_bar": 0.1}, "0 to 0.1 bar"),
        ("esp32", {"device": "x", "potentiometers": [[1], [2]]}, "potentiometers"),
        ("festo-cpx", {}, "festo_cpx.host"),
        ("festo-cpx", {"host": "x", "valves": [0, 1, 1]}, "valve 1"),
        ("festo-vtem", {"host": "x", "valves": [0, 1]}, "2 valves for 3"),
        ("festo-vtem", {"host": "x", "output_base": 65535}, "output_base = 65535"),
        ("festo-cpx", {"host": "x", "ceiling_bar": 0.1}, "ceiling_bar = 0.1"),
        ("replay", {}, "replay.log"),
        ("replay", {"log": "/nowhere.mcap"}, "/nowhere.mcap"),
    ],
)
def test_what_does_not_fit_is_refused_before_a_device_is_touched(
    adapter: str, table: dict[str, Any], words: str
) -> None:
    whole = configuration(adapter, **{adapter.replace("-", "_"): table})
    assert words in refusal(whole)


ALL = devices().usable


def emulated_options(device: EmulatedDevice[Any]) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    device.add_arguments(parser)
    return parser.parse_args([])


@contextmanager
def reachable(device: Device[Any]) -> Iterator[dict[str, object]]:
    """Keys of a device's table under which it is there."""
    if not isinstance(device, EmulatedDevice):
        yield {}
        return
    whole = backends.fitting(device, "table1")
    config, arm = whole.of_device(device), whole.build_arm()
    with device.emulate(config, arm, EmulatedArm(arm, 0), emulated_options(device)) as running:
        yield dict(running.table)


@pytest.mark.parametrize("name", ALL)
def test_a_second_daemon_on_a_device_is_refused_whatever_its_arm_is_called(name: str) -> None:
    def named(arm: str) -> config.Configuration:
        tables = backends.fitting(ALL[name], "table1").model_dump(exclude_none=True)
        tables["arm"]["name"] = arm
        tables["hardware"] |= {"adapter": name, "device": f"bench-{os.getpid()}"}
        tables[ALL[name].table] |= keys
        return config.check(tables)

    refused = pytest.raises(AlreadyInUse, match=str(os.getpid()))
    with reachable(ALL[name]) as keys, lock("device", backends.address(named("one"))), refused:
        lock("device", backends.address(named("other")))


def test_a_device_without_an_address_cannot_be_made() -> None:
    class Careless(Device[ReplayConfig]):
        name, summary, config = "careless", "no address", ReplayConfig

        def build(self, config: ReplayConfig, arm: Any) -> Any: ...

        def left_behind(self, config: ReplayConfig) -> str:
            return ""

    with pytest.raises(TypeError, match="address"):
        Careless()  # type: ignore[abstract]


def test_the_lock_is_on_the_port_by_whatever_link_it_is_called(tmp_path: Path) -> None:
    port, link = tmp_path / "port", tmp_path / "by-id"
    port.touch()
    os.symlink(port, link)
    assert SerialPort(str(port)).lock == SerialPort(str(link)).lock
    assert TcpPort("localhost", 502).lock == TcpPort("127.0.0.1", 502).lock


WITHOUT_WATCHDOG = {
    "ctrl-p": {"device": "/dev/ttyACM0"},
    "esp32": {"device": "/dev/ttyACM0"},
    "festo-cpx": {"host": "10.0.0.2", "watchdog_ms": 0},
    "festo-vtem": {"host": "10.0.0.2", "watchdog_ms": 0},
}


@pytest.mark.parametrize("adapter", WITHOUT_WATCHDOG)
def test_without_a_watchdog_it_starts_only_when_that_is_accepted(adapter: str) -> None:
    """And then the start says what stays in the arm."""
    table = {adapter.replace("-", "_"): WITHOUT_WATCHDOG[adapter]}
    left = configuration(adapter, **table)
    sentence = left.device.left_behind(left.of_device(left.device))
    text = refusal(configuration(adapter, accept=False, **table))
    assert "accept_no_watchdog = true" in text
    assert sentence in text
    backends.check(left)
    assert backends.warnings(left) == [sentence]


def point(name: str, found: object) -> object:
    return SimpleNamespace(
        name=name, value=f"lab.device:{name}", dist=SimpleNamespace(name="lab"), load=lambda: found
    )


class Good(Device[ReplayConfig]):
    """A device of a laboratory, made from its name and its table."""

    summary = "of a laboratory"
    config = ReplayConfig

    def __init__(self, name: str, config: type[Any] = ReplayConfig) -> None:
        self.name, self.config = name, config  # type: ignore[misc]

    def build(self, config: ReplayConfig, arm: Any) -> Any: ...

    def address(self, config: ReplayConfig) -> Bus:
        return Bus("can0/12")

    def left_behind(self, config: ReplayConfig) -> str:
        return ""


class Nameless(Good):
    """A device that does not say what it is."""

    summary = None  # type: ignore[assignment]


class NeedsAHost(Table):
    """A table that cannot be left out."""

    host: str


@pytest.mark.parametrize(
    ("name", "found", "fact"),
    [
        ("box", object(), "no object"),
        ("box", Good("other"), "'other'"),
        ("esp32", Good("esp32"), "another device"),
        ("Box", Good("Box"), "small letters"),
        ("camera", Good("camera"), "camera"),
        ("box", Good("box", dict), "Table"),
        ("box", Good("box", NeedsAHost), "host"),
        ("zenoh", Good("zenoh"), "[zenoh]"),
        ("device", Good("device"), "[device]"),
        ("box", Nameless("box"), "summary"),
    ],
)
def test_a_device_that_cannot_stand_beside_the_others_is_set_aside(
    monkeypatch: pytest.MonkeyPatch, name: str, found: object, fact: str
) -> None:
    points = [point(name, found), point("good", Good("good"))]
    monkeypatch.setattr(devices_module, "entry_points", lambda group: points)
    all_devices = devices_module.devices.__wrapped__()
    all_devices.set_aside({"zenoh", "device"})
    assert set(all_devices.usable) == {*ALL, "good"}
    sentence = str(all_devices.broken[name])
    for told in (repr(name), fact):
        assert told in sentence
    assert "\n" not in sentence
    if name not in ALL:
        with pytest.raises(ConfigurationError, match=re.escape(sentence)):
            all_devices.named(name)


def test_control_loads_no_device_but_the_simulator_and_no_reader_of_logs() -> None:
    """All kinds of device are known in every process, and cost none of them their libraries."""
    heavy = ["mcap", "zenoh", "rerun", "pymodbus", "serial", "mujoco"]
    heavy += ["pneuarm.hardware.simulator.rod"]
    code = (
        "import sys, pneuarm.service.control.process\n"
        "from pneuarm.service.configuration.devices import devices\n"
        "assert 'replay' in devices().usable\n"
        f"print([name for name in {heavy} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stdout + done.stderr


def texts(path: Path) -> set[str]:
    """All texts of a module, but those that are a command's name."""
    tree = ast.parse(path.read_text())
    found = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)}
    return {text for text in found if isinstance(text, str)}


@pytest.mark.parametrize("path", sorted((ROOT / "service").rglob("*.py")), ids=lambda p: p.stem)
def test_the_daemon_knows_no_device_by_its_name(path: Path) -> None:
    names = {name for device in ALL.values() for name in (device.name, device.table)}
    if path == ROOT / "service" / "cli" / "parser.py":
        names -= {"replay"}  # the command
    assert not texts(path) & names


def test_a_log_takes_the_place_of_a_device(tmp_path: Path) -> None:
    """There is no air in it: it needs nobody's word about a watchdog."""
    plain = configuration("simulator")
    path = record(tmp_path / "a.mcap", plain.build_arm(), 10)
    whole = configuration("replay", accept=False, replay={"log": str(path)})
    backends.check(whole)
    assert isinstance(backends.build(whole, whole.build_arm()), ReplayDevice)

"""The arm with a body in MuJoCo as a device: what repeats, what is configured, what is missing."""

import sys
from typing import Any

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import ConfigurationError, NotInstalled
from pneuarm.hardware.interface import Hardware
from pneuarm.hardware.mujoco.device import DEVICE
from pneuarm.service.configuration.configuration import Configuration, check, load
from pneuarm.service.daemon.info import info_of
from pneuarm.service.devices import registry
from tests.hardware.simulator.test_simulator import session

BENDING_PA = np.array([[-4e4, 2e4, 3e4]])


def configuration(preset: str = "paper", **table: object) -> Configuration:
    tables: dict[str, Any] = load(preset=preset).model_dump(exclude_none=True)
    tables["hardware"]["adapter"] = DEVICE.name
    tables[DEVICE.table] |= table
    return check(tables, "own.toml")


def built(whole: Configuration) -> Hardware:
    return registry.build(whole, whole.build_arm())


def rested_tip(hardware: Hardware, pressures_pa: Array, seconds: float = 4.0) -> Array:
    hardware.connect()
    hardware.read(0.0)
    hardware.write(pressures_pa, 0.0)
    tip = hardware.read(seconds).true_tip
    assert tip is not None
    return tip[0]


def test_the_same_calls_give_the_same_bits() -> None:
    """A second arm of the seed, and the same arm connected again; with something in its way."""
    ball = {"shape": "sphere", "center_mm": [40, 0, 200], "radius_mm": 30}
    hardware = built(configuration(seed=5, obstacles=[ball]))
    first = session(hardware)
    assert session(hardware) == first
    assert session(built(configuration(seed=5, obstacles=[ball]))) == first
    assert session(built(configuration(seed=6, obstacles=[ball]))) != first


def test_it_bends_where_the_simulator_bends() -> None:
    """By the same air: of one seed, within a centimetre of each other, and not at one place."""
    for seed in range(3):
        tables = load(preset="paper").model_dump(exclude_none=True)
        tables["simulator"]["seed"] = seed
        own = rested_tip(built(check(tables)), BENDING_PA)
        other = rested_tip(built(configuration(seed=seed)), BENDING_PA)
        assert 1e-4 < np.linalg.norm(own - other) < 1e-2


def test_keep_outs_and_obstacles_are_solid() -> None:
    """What the controller avoids, and what it does not know of."""
    wall = {"shape": "half_space", "normal": [-1, 0, 0], "offset_mm": 20}
    free = rested_tip(built(configuration()), -2.0 * BENDING_PA)
    assert free[0] < -0.025
    tables: dict[str, Any] = configuration().model_dump(exclude_none=True)
    tables["arm"]["keep_outs"] = [wall]
    for whole in (configuration(obstacles=[wall]), check(tables)):
        assert rested_tip(built(whole), -2.0 * BENDING_PA)[0] == pytest.approx(-0.019, abs=1e-3)
    assert not configuration(obstacles=[wall]).build_arm().keep_outs


def test_it_has_the_simulators_valves() -> None:
    """Slow ones have filled the chambers by less, and bent the arm by less, in the same time."""
    moved = {}
    for valves in ("servo", "itv"):
        hardware = built(configuration(valves=valves))
        hardware.connect()
        still = hardware.read(0.0).true_tip
        hardware.write(2.0 * BENDING_PA, 0.0)
        reading = hardware.read(0.25)
        assert still is not None
        assert reading.true_tip is not None
        moved[valves] = (reading.pressures_pa[0, 2], np.linalg.norm(reading.true_tip[0] - still[0]))
    assert moved["itv"][0] < 0.8 * moved["servo"][0]
    assert moved["itv"][1] < 0.8 * moved["servo"][1]


def test_its_seed_and_what_is_drawn_from_it_are_in_the_info() -> None:
    whole = configuration(seed=11, segments_per_section=6)
    told = dict(info_of(whole, whole.build_arm(), "").simulator)
    assert (told["seed"], told["segments_per_section"]) == (11.0, 6.0)
    drawn = built(whole).drawn.as_dict()  # type: ignore[attr-defined]
    assert told == {name: drawn[name] for name in told}


def test_an_odd_number_of_links_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"mujoco\.segments_per_section = 5"):
        configuration(segments_per_section=5)


def test_without_mujoco_it_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the check before the start, and where it is made; other devices do not care."""
    whole = configuration()
    monkeypatch.setitem(sys.modules, "mujoco", None)
    for call in (lambda: registry.check(whole), lambda: built(whole)):
        with pytest.raises(NotInstalled) as told:
            call()
        assert 'pip install "pneuarm[mujoco]"' in str(told.value)
        assert '"mujoco"' in str(told.value)
        assert "\n" not in str(told.value)
    registry.check(load(preset="paper"))

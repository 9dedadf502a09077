"""The arm of a show fits the device behind which it is."""

import pytest

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.service.configuration.configuration import PRESETS, load
from pneuarm.service.configuration.tables.table import BAR
from pneuarm.service.demo.device import emulated, fitting


@pytest.mark.parametrize("arm", PRESETS)
def test_the_arm_behind_an_esp32_needs_no_more_than_its_pump_gives(arm: str) -> None:
    found, builtin = fitting("esp32", arm), load(preset=arm)
    built = found.build_arm()
    assert built.per_chamber("pressure_min_pa").min() >= 0.0
    assert built.per_chamber("pressure_max_pa").max() < found.esp32.ceiling_bar * BAR
    low, high = length_bounds_m(built)
    assert (high - low).min() > 0.05
    assert built.rest_lengths_m.tolist() == builtin.build_arm().rest_lengths_m.tolist()


@pytest.mark.parametrize("adapter", ["festo-cpx", "festo-vtem", "ctrl-p"])
def test_every_other_device_moves_the_built_in_arm(adapter: str) -> None:
    assert fitting(adapter, "paper") == load(preset="paper")


def test_the_simulator_needs_nothing_beside_it() -> None:
    with emulated("simulator", "paper", 0) as tables:
        assert tables == {}


def test_the_daemon_is_told_of_the_arm_that_its_device_moves() -> None:
    with emulated("esp32", "paper", 0) as tables:
        assert tables["arm"] == fitting("esp32", "paper").arm.model_dump(exclude_none=True)
        assert tables["hardware"] == {"adapter": "esp32", "accept_no_watchdog": True}

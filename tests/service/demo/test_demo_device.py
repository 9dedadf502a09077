"""The arm of a show fits the device behind which it is."""

import pytest

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.hardware.esp32.device import DEVICE as ESP32
from pneuarm.hardware.tables.table import BAR
from pneuarm.service.configuration.configuration import PRESETS, load
from pneuarm.service.configuration.devices import AnyDevice, devices
from pneuarm.service.demo.device import emulated
from pneuarm.service.devices.registry import fitting


@pytest.mark.parametrize("arm", PRESETS)
def test_the_arm_behind_an_esp32_needs_no_more_than_its_pump_gives(arm: str) -> None:
    found, builtin = fitting(ESP32, arm), load(preset=arm)
    built = found.build_arm()
    assert built.per_chamber("pressure_min_pa").min() >= 0.0
    assert built.per_chamber("pressure_max_pa").max() < found.esp32.ceiling_bar * BAR
    low, high = length_bounds_m(built)
    assert (high - low).min() > 0.05
    assert built.rest_lengths_m.tolist() == builtin.build_arm().rest_lengths_m.tolist()


@pytest.mark.parametrize("device", devices().usable.values(), ids=lambda device: device.name)
def test_every_device_has_an_arm_that_it_can_move(device: AnyDevice) -> None:
    """The built-in one, where it needs no other."""
    fits = fitting(device, "paper")
    assert (fits == load(preset="paper")) == (not device.demo_section)


@pytest.mark.parametrize("name", ["simulator", "mujoco"])
def test_a_simulated_arm_needs_no_more_than_its_seed_and_valves(name: str) -> None:
    with emulated(name, "paper", 7, "itv") as tables:
        own = {"seed": 7, "valves": "itv"}
        assert tables == {"hardware": {"adapter": name}, name: own}


def test_the_daemon_is_told_of_the_arm_that_its_device_moves() -> None:
    with emulated("esp32", "paper", 0, "itv") as tables:
        assert tables["arm"] == fitting(ESP32, "paper").arm.model_dump(exclude_none=True)
        assert tables["hardware"] == {"adapter": "esp32", "accept_no_watchdog": True}

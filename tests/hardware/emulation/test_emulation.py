"""The emulated arm: its air follows setpoints and faults; what arrived is recorded."""

import json
from pathlib import Path

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.hardware.emulation.emulation import DeviceRecord, EmulatedArm
from pneuarm.hardware.simulator.parameters import NOMINAL, Valves
from pneuarm.hardware.transports.transport_faults import TransportFaults
from tools.rig.arms import paper_arm

SETPOINTS_PA = np.array([[4e4, 2e4, -3e4]])


def settled(*faults: str, seconds: float = 2.0) -> EmulatedArm:
    arm = EmulatedArm(paper_arm(), 0)
    arm.advance(0.0)
    arm.set_pressures_pa(SETPOINTS_PA, 0.0)
    arm.advance(1.0)
    for words in faults:
        arm.inject(words)
    for number in range(round(seconds / 0.02)):
        arm.advance(1.0 + 0.02 * (number + 1))
    return arm


def test_a_healthy_arm_follows_and_lengthens() -> None:
    arm = settled()
    np.testing.assert_allclose(arm.pressures_pa, SETPOINTS_PA, atol=3000.0)
    lengths = arm.lengths_m[0]
    assert lengths[0] > lengths[1] > lengths[2]
    assert arm.tip()[0][0] < -0.01  # away from its longest chamber


@pytest.mark.parametrize(
    ("words", "expected_pa"),
    [
        ("valve-stuck-open 1", [4e4, 1.125e5, -3e4]),
        ("leak 0", [1.5e4, 2e4, -3e4]),
        ("supply-lost", [0.0, 0.0, 0.0]),
        ("stop-pressed", [0.0, 0.0, 0.0]),
    ],
)
def test_faults_change_the_air(words: str, expected_pa: list[float]) -> None:
    arm = settled(words)
    np.testing.assert_allclose(arm.true_pressures_pa, [expected_pa], atol=4000.0)
    np.testing.assert_allclose(arm.pressures_pa, arm.true_pressures_pa, atol=2000.0)
    assert arm.stop_pressed == (words == "stop-pressed")
    assert (arm.supply_pa < 5000.0) == (words == "supply-lost")


def test_a_valve_stuck_closed_traps_its_air_until_cleared() -> None:
    arm = settled("valve-stuck-closed 0")
    arm.zero_all(3.0, "watchdog")
    arm.advance(5.0)
    assert arm.true_pressures_pa[0, 0] > 3e4
    arm.inject("clear")
    arm.advance(7.0)
    assert np.abs(arm.true_pressures_pa).max() < 1.0


def test_sensor_faults_leave_the_air_alone() -> None:
    arm = settled("sensor-nan 0", "sensor-offset 1 0.5", "sensor-frozen 2")
    frozen_pa = arm.pressures_pa[0, 2]
    arm.zero_all(3.0, "stop")
    arm.advance(5.0)
    assert np.abs(arm.true_pressures_pa).max() < 1.0
    assert np.isnan(arm.pressures_pa[0, 0])
    assert arm.pressures_pa[0, 1] == pytest.approx(5e4, abs=2000.0)
    assert arm.pressures_pa[0, 2] == frozen_pa


def test_a_noisy_sensor_is_noisier_than_a_good_one() -> None:
    arm = settled("sensor-noisy 0")
    readings: list[Array] = []
    for number in range(200):
        arm.advance(3.0 + 0.01 * number)
        readings.append(arm.pressures_pa[0])
    spread_pa = np.std(readings, axis=0)
    assert spread_pa[0] > 1e4 > 1e3 > spread_pa[1]


@pytest.mark.parametrize("words", ["leak", "leak 3", "leak -1", "burst 0", "sensor-offset 0 x", ""])
def test_words_that_mean_nothing_are_refused(words: str) -> None:
    with pytest.raises(InvalidInput, match="fault"):
        EmulatedArm(paper_arm(), 0).inject(words)


def test_the_record_holds_changes_and_samples(tmp_path: Path) -> None:
    path = tmp_path / "device.jsonl"
    arm = EmulatedArm(paper_arm(), 0, DeviceRecord(path))
    for number in range(100):
        arm.set_pressures_pa(SETPOINTS_PA, 0.01 * number)
        arm.advance(0.01 * number)
    arm.zero_all(1.0, "watchdog")
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    changes = [line for line in lines if "setpoints_pa" in line]
    assert [(line["time_s"], line["why"]) for line in changes] == [
        (0.0, "write"),
        (1.0, "watchdog"),
    ]
    assert changes[0]["setpoints_pa"] == SETPOINTS_PA.reshape(-1).tolist()
    samples = [line for line in lines if "measured_pa" in line]
    assert 33 <= len(samples) <= 51


def test_transport_faults_last_as_long_as_said() -> None:
    faults = TransportFaults()
    assert faults.inject("silence 0.5", 10.0)
    assert faults.silent(10.4)
    assert not faults.silent(10.6)
    assert faults.inject("exception 2", 11.0)
    assert [faults.refuses() for _ in range(3)] == [True, True, False]
    assert faults.inject("wrong", 11.0)
    assert [faults.once("wrong") for _ in range(2)] == [True, False]
    assert faults.inject("slow 20", 11.0)
    assert faults.delay_s == 0.02
    assert not faults.inject("clear", 11.0)
    assert faults.delay_s == 0.0
    assert not faults.inject("leak 0", 11.0)
    with pytest.raises(InvalidInput):
        faults.inject("slow", 11.0)


@pytest.mark.parametrize("valves", ["itv", "onoff"])
def test_faults_break_every_kind_of_valves_alike(valves: Valves) -> None:
    """A trapped chamber stays, a lost supply takes the air; cleared, all of it goes out."""
    arm = EmulatedArm(paper_arm(), 0, nominal=NOMINAL[valves])
    arm.advance(0.0)
    arm.set_pressures_pa(SETPOINTS_PA, 0.0)
    for number in range(300):
        arm.advance(0.02 * number)
    np.testing.assert_allclose(arm.true_pressures_pa, SETPOINTS_PA, atol=4000.0)
    arm.inject("valve-stuck-closed 0")
    arm.inject("supply-lost")
    for number in range(300, 600):
        arm.advance(0.02 * number)
    np.testing.assert_allclose(arm.true_pressures_pa, [[0.0, 0.0, 0.0]], atol=4000.0)
    arm.inject("clear")
    arm.zero_all(12.0, "watchdog")
    for number in range(600, 900):
        arm.advance(0.02 * number)
    assert np.abs(arm.true_pressures_pa).max() < 1.0

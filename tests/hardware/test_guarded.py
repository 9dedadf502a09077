"""The guard right before the device: what is allowed, and from where the slew counts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.guard import Guard, Intervention
from pneuarm.hardware.guarded import GuardedDevice
from pneuarm.hardware.interface import Measurement
from tools.rig.arms import PAPER_SECTION, paper_arm

PERIOD_S = 0.005
SLEW = PAPER_SECTION.pressure_slew_max_pa_s
ZEROS = np.zeros((1, 3))


class Device:
    """A device that takes whole steps and writes down what it was told."""

    def __init__(self, step_pa: float) -> None:
        self.step_pa = step_pa
        self.told: list[Array] = []
        self.fails = False

    def connect(self) -> None:
        self.told.append(ZEROS)

    def read(self, time_s: float) -> Measurement:
        return Measurement(ZEROS, ZEROS)

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        if self.fails:
            raise HardwareError("gone")
        sent = self.step_pa * np.trunc(pressures_pa / self.step_pa)
        self.told.append(sent)
        return sent

    def vent(self, time_s: float) -> None:
        self.told.append(ZEROS)

    def close(self) -> None:
        pass


def bench(step_pa: float = 100.0) -> tuple[GuardedDevice, Device]:
    device = Device(step_pa)
    guarded = GuardedDevice(device, Guard(paper_arm(), PERIOD_S), 1)
    guarded.connect()
    guarded.vent(0.0)
    return guarded, device


@given(st.lists(st.floats(-3e5, 3e5), min_size=1, max_size=30), st.floats(1e-4, 2e-2))
def test_steps_of_the_device_never_add_up_to_more_than_the_slew(
    wishes: list[float], period_s: float
) -> None:
    guarded, device = bench()
    for number, wish in enumerate(wishes):
        now_s = period_s * (number + 1)
        guarded.write(np.full((1, 3), wish), now_s, now_s)
        told = np.array(device.told)[2:]
        assert np.abs(told).max() <= PAPER_SECTION.pressure_max_pa
        assert np.abs(told[-1]).max() <= SLEW * now_s + 1e-6  # from zero, in the time gone by
        if len(told) > 1:
            assert np.abs(told[-1] - told[-2]).max() <= SLEW * period_s + device.step_pa + 1e-6


def test_a_slew_slower_than_one_step_a_write_gets_there_all_the_same() -> None:
    guarded, device = bench(step_pa=100.0)
    period_s = 0.2 * 100.0 / SLEW  # a fifth of a step
    for number in range(100):
        now_s = period_s * (number + 1)
        guarded.write(np.full((1, 3), 2e3), now_s, now_s)
    np.testing.assert_allclose(device.told[-1], 2e3, atol=100.0)


def test_it_tells_what_was_sent_and_what_was_changed() -> None:
    guarded, device = bench()
    written = guarded.write(np.full((1, 3), 1e9), 0.01, 0.01)
    assert written.intervention == Intervention.RANGE | Intervention.SLEW
    assert np.array_equal(written.pressures_pa, device.told[-1])
    assert np.array_equal(guarded.sent_pa, device.told[-1])
    assert guarded.write(ZEROS, 0.02, 0.1).intervention == Intervention.TOO_OLD
    assert np.array_equal(device.told[-1], ZEROS)


def test_a_write_without_an_answer_does_not_count() -> None:
    guarded, device = bench()
    device.fails = True
    for now_s in (0.1, 0.2):
        with pytest.raises(HardwareError):
            guarded.write(np.full((1, 3), 5e4), now_s, now_s)
    assert np.array_equal(guarded.sent_pa, ZEROS)


def test_the_slew_counts_from_when_the_answer_came() -> None:
    guarded, device = bench()
    guarded.write(np.full((1, 3), 1e9), 0.01, 0.01)
    guarded.acknowledged(0.05)
    first = device.told[-1]
    guarded.write(np.full((1, 3), 1e9), 0.051, 0.051)
    assert (device.told[-1] - first <= SLEW * 0.001 + device.step_pa).all()

"""What a device did not take is not believed to be there, unless it is a step of its own."""

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.hardware.guard import Guard
from pneuarm.hardware.guarded import GuardedDevice
from pneuarm.hardware.interface import Measurement
from tools.rig.arms import PAPER_SECTION, paper_arm

PERIOD_S = 0.005
SLEW = PAPER_SECTION.pressure_slew_max_pa_s
ZEROS = np.zeros((1, 3))
#: The coarsest step that a device of ours has, see docs/hardware.
STEP_PA = 100.0


class ShortDevice:
    """A device that takes less than it is asked, and writes down both and every other call."""

    def __init__(self, shortfall_pa: float) -> None:
        self.shortfall_pa = shortfall_pa
        self.asked: list[Array] = []
        self.calls: list[tuple[str, float]] = []

    def connect(self) -> None:
        self.calls.append(("connect", 0.0))

    def read(self, time_s: float) -> Measurement:
        self.calls.append(("read", time_s))
        return Measurement(np.full((1, 3), time_s), ZEROS)

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        self.calls.append(("write", time_s))
        self.asked.append(pressures_pa.copy())
        return pressures_pa - self.shortfall_pa

    def vent(self, time_s: float) -> None:
        self.calls.append(("vent", time_s))

    def close(self) -> None:
        self.calls.append(("close", 0.0))


def bench(shortfall_pa: float) -> tuple[GuardedDevice, ShortDevice]:
    device = ShortDevice(shortfall_pa)
    guarded = GuardedDevice(device, Guard(paper_arm(), PERIOD_S), 1)
    guarded.connect()
    guarded.vent(0.0)
    return guarded, device


def push(guarded: GuardedDevice, now_s: float) -> Array:
    """Ask for more than the slew allows; return what the device acknowledged."""
    return guarded.write(np.full((1, 3), 8e4), now_s, now_s).pressures_pa


@pytest.mark.parametrize("shortfall_pa", [1.5 * STEP_PA, 2.0 * STEP_PA, 1e3, 1e4, -1e3])
def test_the_slew_counts_from_what_the_device_took_and_not_from_what_it_was_asked(
    shortfall_pa: float,
) -> None:
    guarded, device = bench(shortfall_pa)
    took = push(guarded, 0.05)
    np.testing.assert_allclose(took, device.asked[-1] - shortfall_pa)
    push(guarded, 0.05 + PERIOD_S)
    np.testing.assert_allclose(device.asked[-1], took + SLEW * PERIOD_S)


@pytest.mark.parametrize("shortfall_pa", [STEP_PA, -STEP_PA, 0.5 * STEP_PA])
def test_less_than_a_step_of_the_device_is_its_rounding(shortfall_pa: float) -> None:
    guarded, device = bench(shortfall_pa)
    push(guarded, 0.05)
    allowed = device.asked[-1]
    push(guarded, 0.05 + PERIOD_S)
    np.testing.assert_allclose(device.asked[-1], allowed + SLEW * PERIOD_S)


def test_after_an_answer_the_slew_counts_from_what_it_acknowledged() -> None:
    guarded, device = bench(1e3)
    took = push(guarded, 0.05)
    guarded.acknowledged(0.07)
    push(guarded, 0.07 + PERIOD_S)
    np.testing.assert_allclose(device.asked[-1], took + SLEW * PERIOD_S)


def test_venting_and_connecting_begin_at_zero() -> None:
    for again in (lambda g: g.vent(0.1), lambda g: (g.connect(), g.vent(0.1))):
        guarded, device = bench(0.0)
        assert push(guarded, 0.05).any()
        again(guarded)
        assert np.array_equal(guarded.sent_pa, ZEROS)
        push(guarded, 0.1 + PERIOD_S)
        np.testing.assert_allclose(device.asked[-1], np.full((1, 3), SLEW * PERIOD_S))
        guarded.vent(0.2)
        guarded.acknowledged(0.3)  # what was acknowledged last is zeros
        push(guarded, 0.3 + PERIOD_S)
        np.testing.assert_allclose(device.asked[-1], np.full((1, 3), SLEW * PERIOD_S))


def test_connecting_again_forgets_what_was_sent() -> None:
    guarded, _ = bench(0.0)
    assert push(guarded, 0.05).any()
    guarded.connect()
    assert np.array_equal(guarded.sent_pa, ZEROS)


def test_every_call_reaches_the_device_with_its_time_and_zeros_are_nobodys_to_change() -> None:
    guarded, device = bench(0.0)
    push(guarded, 0.05)
    assert guarded.read(0.06).pressures_pa[0, 0] == 0.06
    guarded.vent(0.07)
    guarded.close()
    assert device.calls == [
        ("connect", 0.0),
        ("vent", 0.0),
        ("write", 0.05),
        ("read", 0.06),
        ("vent", 0.07),
        ("close", 0.0),
    ]
    with pytest.raises(ValueError, match="read-only"):
        guarded.sent_pa[:] = 1.0


def test_before_it_is_connected_nothing_was_sent() -> None:
    device = ShortDevice(0.0)
    guarded = GuardedDevice(device, Guard(paper_arm(), PERIOD_S), 1)
    assert np.array_equal(guarded.sent_pa, ZEROS)
    guarded.acknowledged(0.1)
    push(guarded, 0.1 + PERIOD_S)
    np.testing.assert_allclose(device.asked[-1], np.full((1, 3), SLEW * PERIOD_S))

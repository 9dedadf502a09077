"""The guard as it stands before a device: an old command becomes zeros there, and is said."""

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.hardware.guard import Guard, Intervention
from pneuarm.hardware.guarded import GuardedDevice
from pneuarm.hardware.simulator.adapter import SimulatedArm
from pneuarm.hardware.simulator.parameters import SimulatorParameters
from tools.rig.arms import paper_arm

ARM = paper_arm()


class Taken(SimulatedArm):
    """Remembers what reached the device."""

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        self.newest = pressures_pa.copy()
        return super().write(pressures_pa, time_s)


def device_of(flow_pa_s: float = np.inf) -> tuple[GuardedDevice, Taken]:
    device = Taken(ARM, SimulatorParameters(), seed=0)
    guarded = GuardedDevice(device, Guard(ARM, 0.001, flow_pa_s), ARM.n_sections)
    guarded.connect()
    guarded.vent(0.0)
    return guarded, device


def test_a_command_that_waited_too_long_becomes_zeros_at_the_device() -> None:
    guarded, device = device_of()
    wanted = np.full((1, 3), 500.0)
    fresh = guarded.write(wanted, 1.0, 1.04)
    assert fresh.intervention == Intervention.NOTHING
    np.testing.assert_array_equal(device.newest, wanted)
    old = guarded.write(wanted, 1.0, 1.06)
    assert old.intervention == Intervention.TOO_OLD
    np.testing.assert_array_equal(device.newest, 0.0)
    again = guarded.write(wanted, 1.061, 1.061)  # and from there the slew counts anew
    assert again.intervention == Intervention.SLEW
    assert (device.newest > 0.0).all()
    assert (device.newest < wanted).all()


def test_a_limited_supply_reaches_the_device() -> None:
    guarded, device = device_of(flow_pa_s=1e4)
    sent = guarded.write(np.array([[500.0, 0.0, 0.0]]), 0.003, 0.003)
    assert sent.intervention == Intervention.SUPPLY
    np.testing.assert_allclose(device.newest, [[30.0, 0.0, 0.0]])

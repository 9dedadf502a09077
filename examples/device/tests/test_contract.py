"""The valve box keeps the contract of every device: this is all that it takes to test it."""

from valve_box.device import DEVICE
from valve_box.protocol import STEP_PA

from pneuarm.service.devices.contract import DeviceContract


class TestValveBox(DeviceContract):
    """On its emulator, with vacuum and without."""

    device = DEVICE
    resolution_pa = STEP_PA

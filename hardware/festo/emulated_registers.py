"""What both emulated Festo terminals answer out of: registers, and what their valves measure."""

import numpy as np

from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.festo.counts import COUNT_PA
from pneuarm.hardware.transports.modbus import from_signed


def read_from(found: dict[int, int], address: int, count: int) -> list[int] | None:
    """Return registers out of those that a terminal has, None where one is not there."""
    wanted = range(address, address + count)
    if not all(number in found for number in wanted):
        return None
    return [from_signed(found[number]) for number in wanted]


def measured_counts(arm: EmulatedArm, valves: tuple[int, ...], valve: int) -> int:
    """Counts that a valve measures; what is no number reads as the lowest, as of a broken sensor.

    ``valves`` names the valve of every chamber; one that moves none measures zero.
    """
    if valve not in valves:
        return 0
    measured_pa = arm.pressures_pa.reshape(-1)[valves.index(valve)]
    return -32768 if np.isnan(measured_pa) else round(float(measured_pa) / COUNT_PA)

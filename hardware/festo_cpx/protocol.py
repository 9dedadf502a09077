"""Registers <-> values of VPPM valves on a CPX terminal; no transport here.

Setpoint of valve i: one register, 1 mbar a count. Valve i reads back three: actual, setpoint,
diagnosis. Addresses are zero-based protocol addresses.
"""

from dataclasses import dataclass

import numpy as np

from controllers.arm import Array
from hardware.modbus import from_signed, runs, to_signed

#: Pa of one count.
COUNT_PA = 100.0

#: A command this near (counts) below a count is that count: 300 mbar is never sent as 299.
_COUNT_TOLERANCE = 1e-6

#: The standard numbering of faults on Festo's CPX terminals.
_DIAGNOSES = {
    1: "short circuit",
    2: "undervoltage",
    3: "overvoltage",
    4: "overload",
    5: "too hot",
    6: "cable break",
    7: "above its upper limit",
    8: "below its lower limit",
    26: "fault in the supply of the actuators",
    31: "channel failed",
}


@dataclass(frozen=True)
class CpxLayout:
    """Where the valves lie. ``valves`` holds a valve's number for every chamber, flat."""

    valves: tuple[int, ...]
    output_base: int = 40003
    output_stride: int = 1
    input_base: int = 45395
    input_stride: int = 3

    def output_blocks(self, counts: list[int]) -> list[tuple[int, list[int]]]:
        """Return (address, registers) of the writes that set every chamber's count.

        Valves that follow each other without a gap share a write.
        """
        register_of = {
            self.output_base + self.output_stride * valve: from_signed(count)
            for valve, count in zip(self.valves, counts, strict=True)
        }
        return [
            (first, [register_of[first + index] for index in range(length)])
            for first, length in runs(register_of)
        ]

    @property
    def input_block(self) -> tuple[int, int]:
        """First register and how many hold every valve's three."""
        first, last = min(self.valves), max(self.valves)
        return self.input_base + self.input_stride * first, self.input_stride * (last - first) + 3

    def decode(self, registers: list[int]) -> "CpxInputs":
        """Return what an input block says, chamber by chamber."""
        first = min(self.valves)
        at = [self.input_stride * (valve - first) for valve in self.valves]
        return CpxInputs(
            actual=[to_signed(registers[index]) for index in at],
            setpoint=[to_signed(registers[index + 1]) for index in at],
            diagnosis=[registers[index + 2] for index in at],
        )


@dataclass(frozen=True)
class CpxInputs:
    """Actual and set counts and the diagnosis, one a chamber, flat."""

    actual: list[int]
    setpoint: list[int]
    diagnosis: list[int]


def counts_of(pressures_pa: Array) -> list[int]:
    """Return whole counts, flat: the nearest that are no further from ambient than asked for."""
    counts = pressures_pa.reshape(-1) / COUNT_PA
    nudged = counts + np.copysign(_COUNT_TOLERANCE, counts)
    return [int(count) for count in np.trunc(nudged).tolist()]


def pressures_of(counts: list[int], n_sections: int) -> Array:
    """Return gauge pressures (n_sections, 3) in Pa."""
    return np.array(counts, dtype=np.float64).reshape(n_sections, 3) * COUNT_PA


def complaint(valve: int, diagnosis: int) -> str:
    """Return a diagnosis in words."""
    meaning = _DIAGNOSES.get(diagnosis, "see the valve's manual")
    return f"valve {valve} reports diagnosis {diagnosis} ({meaning})"

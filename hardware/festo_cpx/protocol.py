"""Registers <-> values of VPPM valves on a CPX terminal; no transport here.

Setpoint of valve i: one register, 1 mbar a count. Valve i reads back three: actual, setpoint,
diagnosis. Addresses are zero-based protocol addresses.
"""

from dataclasses import dataclass
from functools import cached_property

from pneuarm.hardware.transports.modbus import from_signed, runs, to_signed

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
        return [
            (address, [from_signed(counts[chamber]) for chamber in chambers])
            for address, chambers in self._writes
        ]

    @cached_property
    def _writes(self) -> list[tuple[int, list[int]]]:
        """Address of every write, and the chambers whose counts it takes in their order."""
        chamber_at = {
            self.output_base + self.output_stride * valve: chamber
            for chamber, valve in enumerate(self.valves)
        }
        return [
            (first, [chamber_at[first + index] for index in range(length)])
            for first, length in runs(chamber_at)
        ]

    @cached_property
    def _input_places(self) -> list[int]:
        """Where in an input block each chamber's three registers begin."""
        first = min(self.valves)
        return [self.input_stride * (valve - first) for valve in self.valves]

    @cached_property
    def input_block(self) -> tuple[int, int]:
        """First register and how many hold every valve's three."""
        first, last = min(self.valves), max(self.valves)
        return self.input_base + self.input_stride * first, self.input_stride * (last - first) + 3

    def decode(self, registers: list[int]) -> "CpxInputs":
        """Return what an input block says, chamber by chamber."""
        at = self._input_places
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


def complaint(valve: int, diagnosis: int) -> str:
    """Return a diagnosis in words."""
    meaning = _DIAGNOSES.get(diagnosis, "see the valve's manual")
    return f"valve {valve} reports diagnosis {diagnosis} ({meaning})"

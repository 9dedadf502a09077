"""Registers <-> values of the slots of a VTEM motion terminal; no transport here.

Slot s drives the valves 2 s and 2 s + 1. It takes three registers (command, two setpoints) and
gives three (status, two actual pressures); int16, 1 mbar a count. Command: bits 0 to 5 the app,
bits 6 and 7 the control. Status: bits 0 to 5 the app, bits 6 and 7 its state.
"""

from dataclasses import dataclass

from pneuarm.hardware.transports.modbus import from_signed, runs, to_signed

PRESSURE_REGULATION, ACKNOWLEDGE, OFF = 3, 62, 61
REGULATING, IDLE = 2, 1  # states


def command_word(app: int, control: int) -> int:
    """Return the register that asks for an app."""
    return (app & 0x3F) | (control & 0x3) << 6


REGULATE_COMMAND = command_word(PRESSURE_REGULATION, 3)
ACKNOWLEDGE_COMMAND = command_word(ACKNOWLEDGE, 1)
OFF_COMMAND = command_word(OFF, 0)


def app_and_state(status: int) -> tuple[int, int]:
    """Return what a status register says."""
    return status & 0x3F, status >> 6 & 0x3


@dataclass(frozen=True)
class VtemLayout:
    """Where the slots lie. ``valves`` holds a valve's number for every chamber, flat."""

    valves: tuple[int, ...]
    output_base: int = 40003
    output_stride: int = 3
    input_base: int = 45395
    input_stride: int = 3

    @property
    def slots(self) -> list[int]:
        """Slots with at least one valve of the arm, in their order."""
        return sorted({valve // 2 for valve in self.valves})

    def output_blocks(self, command: int, counts: list[int]) -> list[tuple[int, list[int]]]:
        """Return (address, registers) of the writes that give every slot its command and counts.

        A slot's valve that is not the arm's stays at zero.
        """
        of_valve = dict(zip(self.valves, counts, strict=True))
        register_of: dict[int, int] = {}
        for slot in self.slots:
            values = (command, of_valve.get(2 * slot, 0), of_valve.get(2 * slot + 1, 0))
            first = self.output_base + self.output_stride * slot
            register_of |= {first + index: from_signed(value) for index, value in enumerate(values)}
        return [
            (first, [register_of[first + index] for index in range(length)])
            for first, length in runs(register_of)
        ]

    @property
    def input_block(self) -> tuple[int, int]:
        """First register and how many hold every slot's three."""
        first, last = self.slots[0], self.slots[-1]
        return self.input_base + self.input_stride * first, self.input_stride * (last - first) + 3

    def decode(self, registers: list[int]) -> "VtemInputs":
        """Return what an input block says."""
        first = self.slots[0]
        status = {slot: registers[self.input_stride * (slot - first)] for slot in self.slots}
        actual = [
            to_signed(registers[self.input_stride * (valve // 2 - first) + 1 + valve % 2])
            for valve in self.valves
        ]
        return VtemInputs(status, actual)


@dataclass(frozen=True)
class VtemInputs:
    """Status of every slot, and the actual counts, one a chamber, flat."""

    status: dict[int, int]
    actual: list[int]

    def slots_not_in(self, app: int, state: int) -> list[int]:
        """Return the slots that are not in an app's state."""
        wanted = (app, state)
        return [slot for slot, word in self.status.items() if app_and_state(word) != wanted]

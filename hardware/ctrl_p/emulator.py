"""A Ctrl-P controller without the controller: its command set, with an emulated arm behind it.

It behaves like the firmware where a host can tell: one command a pass, with too few values the
first for all channels, echoes, telemetry, and the trip above ``maxp`` that empties every channel
until a mode is set. Nothing here reads a clock.
"""

import numpy as np

from pneuarm.hardware.channels import Channels
from pneuarm.hardware.ctrl_p.protocol import KPA, Mode
from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.transports.pseudo_terminal import SlowMotion

_UNITS_KPA = {0: ("psi", 6.89475729), 1: ("kPa", 1.0), 2: ("bar", 100.0), 3: ("atm", 101.325)}


class CtrlPEmulator:
    """The controller's side of the port: bytes in, bytes out, at times that are given.

    ``knows_units`` False is a firmware of before the command ``units``: psi for ever.
    """

    def __init__(self, arm: EmulatedArm, channels: Channels, knows_units: bool = True) -> None:
        self.arm, self._motion = arm, SlowMotion()
        self._channels, self._knows_units = channels, knows_units
        self.boot()

    def boot(self) -> None:
        """Start as after power came: in psi, vented, silent."""
        count = self._channels.count
        self._unit, self._period_ms, self._telemetry, self._echo = 0, 50, False, True
        self._setpoints_kpa, self._modes = [0.0] * count, [int(Mode.PRESSURE)] * count
        self._maxp_kpa, self._minp_kpa, self._valve = [344.7] * count, [-344.7] * count, 0.0
        self._said_ms = 0
        self._rest = b""

    def take(self, received: bytes, time_s: float) -> bytes:
        """Carry out the commands that have arrived; return the echoes."""
        *lines, self._rest = (self._rest + received).split(b"\n")
        said = [self._run(line.decode("ascii", "replace").strip(), time_s) for line in lines]
        return b"".join(f"{text}\r\n".encode() for text in said if text and self._echo)

    def advance(self, time_s: float) -> bytes:
        """Let the air move on; return the telemetry that is due."""
        self.arm.advance(self._motion.until(time_s))
        if Mode.VALVE not in self._modes and self._is_too_high():
            self._modes, self._valve = [int(Mode.VALVE)] * self._channels.count, -1.0
            self._apply(time_s, "over-pressure")
        time_ms = round(time_s * 1e3)
        if not self._telemetry or time_ms - self._said_ms < self._period_ms:
            return b""
        self._said_ms = time_ms
        return self._telemetry_lines(time_ms)

    def _is_too_high(self) -> bool:
        measured = self._channels.scatter(self.arm.pressures_pa / KPA)
        return any(value > most for value, most in zip(measured, self._maxp_kpa, strict=True))

    def _telemetry_lines(self, time_ms: int) -> bytes:
        factor = 1.0 / _UNITS_KPA[self._unit][1]
        measured = self._channels.scatter(self.arm.pressures_pa / KPA)
        rows = (self._setpoints_kpa, measured, [self.arm.supply_pa / KPA])
        lines = []
        for kind, row in enumerate(rows):
            values = "\t".join(f"{value * factor:.3f}" for value in row)
            lines.append(f"{time_ms}\t{kind}\t{values}\r\n")
        return "".join(lines).encode()

    def _run(self, line: str, time_s: float) -> str:
        """Carry out one command; return its echo."""
        name, *values = line.lower().split(";")
        try:
            numbers = [float(value) for value in values]
        except ValueError:
            numbers = []
        new = "_NEW " if numbers else "_"
        match name:
            case "set":
                if len(numbers) >= 2:
                    self._set(numbers[1:])
                    self._apply(time_s, "set")
                return f"{new}SET: 0.00\t{self._listed(self._setpoints_kpa, 2)}"
            case "mode":
                self._modes = [int(number) for number in self._all(numbers, self._modes)]
                self._apply(time_s, "mode")
                return f"{new}MODE: " + "".join(f"{mode}\t" for mode in self._modes)
            case "valve":
                self._valve = numbers[0] if numbers else self._valve
                self._apply(time_s, "valve")
                return f"{new}VALVE: {self._valve:.4f}"
            case "units" if self._knows_units:
                self._unit = int(numbers[0]) if numbers else self._unit
                return f"{new}UNITS: {_UNITS_KPA[self._unit][0]}\t{_UNITS_KPA[self._unit][0]}"
            case "maxp":
                self._maxp_kpa = self._in_kpa(self._all(numbers, []), self._maxp_kpa)
                return f"{new}MAXP: {self._listed(self._maxp_kpa, 4)}"
            case "minp":
                self._minp_kpa = self._in_kpa(self._all(numbers, []), self._minp_kpa)
                return f"{new}MINP: {self._listed(self._minp_kpa, 4)}"
            case _:
                return self._run_general(name, numbers, new)

    def _run_general(self, name: str, numbers: list[float], new: str) -> str:
        """Carry out what has nothing to do with pressures."""
        match name:
            case "on" | "off":
                self._telemetry = name == "on"
                return f"_{name.upper()}: Outputs {name.capitalize()}"
            case "time":
                self._period_ms = int(numbers[0]) if numbers else self._period_ms
                return f"{new}TIME: {self._period_ms}"
            case "echo":
                self._echo = bool(numbers[0]) if numbers else self._echo
                return "_ECHO: ON"
            case "chan":
                return f"{new}CHAN: " + "1\t" * self._channels.count
            case _:
                return "_UNREC: Unrecognized Command"

    def _all(self, numbers: list[float], before: list[int]) -> list[float]:
        """Values for all channels: as many, or the first for all, or those of before."""
        if not numbers:
            return [float(value) for value in before]
        count = self._channels.count
        return numbers[:count] if len(numbers) >= count else [numbers[0]] * count

    def _in_kpa(self, values: list[float], before: list[float]) -> list[float]:
        return [value * _UNITS_KPA[self._unit][1] for value in values] or before

    def _listed(self, values_kpa: list[float], decimals: int) -> str:
        factor = 1.0 / _UNITS_KPA[self._unit][1]
        return "\t".join(f"{value * factor:.{decimals}f}" for value in values_kpa)

    def _set(self, numbers: list[float]) -> None:
        wanted = self._in_kpa(self._all(numbers, []), [])
        limits = zip(wanted, self._minp_kpa, self._maxp_kpa, strict=True)
        self._setpoints_kpa = [min(max(value, low), high) for value, low, high in limits]

    def _apply(self, time_s: float, why: str) -> None:
        """Move the valves: to the setpoints, or directly."""
        if Mode.VALVE not in self._modes:
            setpoints_pa = self._channels.gather(self._setpoints_kpa) * KPA
            self.arm.set_pressures_pa(setpoints_pa, time_s, why)
        elif self._valve < 0.0:
            self.arm.zero_all(time_s, why)
        else:  # neither filled nor emptied: what is in the chambers stays there
            held_pa = np.where(np.isnan(self.arm.pressures_pa), 0.0, self.arm.pressures_pa)
            self.arm.set_pressures_pa(held_pa, time_s, why)

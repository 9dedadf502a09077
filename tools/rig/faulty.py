"""A device between the loop and the simulated arm, with every sensor, that can be broken."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.hardware.interface import Hardware, Measurement
from pneuarm.hardware.simulator.adapter import SimulatedArm

SUPPLY_PA = 2e5

#: A setpoint takes this long to the device and back.
SETPOINT_DELAY_S = 0.02


@dataclass
class Faulty:
    """Passes everything on; ``alter`` changes what is read, ``alter_write`` what is written.

    ``rate_hz`` and ``step_pa`` make it a device that is read slowly and rounds its pressures;
    ``has_lengths`` gives it length sensors.
    """

    device: Hardware
    arm: Arm
    rate_hz: float = np.inf
    step_pa: float = 0.0
    has_lengths: bool = False
    alter: Callable[[Measurement, float], Measurement] | None = None
    alter_write: Callable[[Array], Array] | None = None
    newest: Measurement | None = None
    setpoints: list[tuple[float, Array]] = field(default_factory=list)

    def connect(self) -> None:
        self.device.connect()

    def read(self, time_s: float) -> Measurement:
        exact = self.device.read(time_s)
        newest = self.newest
        if newest is None or time_s - (newest.taken_s or 0.0) >= 1.0 / self.rate_hz - 1e-9:
            newest = self.newest = self._sensed(exact, time_s)
        return newest if self.alter is None else self.alter(newest, time_s)

    def _sensed(self, exact: Measurement, time_s: float) -> Measurement:
        pressures, lengths = exact.pressures_pa, exact.lengths_m
        if self.step_pa:
            pressures = self.step_pa * np.rint(pressures / self.step_pa)
        if self.has_lengths:
            assert isinstance(self.device, SimulatedArm)
            lengths = self.arm.rest_lengths_m + self.device._chamber.lengthening_m
        return replace(
            exact,
            pressures_pa=pressures,
            lengths_m=lengths,
            taken_s=time_s,
            supply_pa=SUPPLY_PA,
            setpoints_pa=self._setpoint(time_s),
        )

    def _setpoint(self, time_s: float) -> Array:
        while len(self.setpoints) > 1 and self.setpoints[1][0] <= time_s - SETPOINT_DELAY_S:
            self.setpoints.pop(0)
        return self.setpoints[0][1] if self.setpoints else np.zeros((self.arm.n_sections, 3))

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        self.setpoints.append((time_s, pressures_pa.copy()))
        if self.alter_write is None:
            return self.device.write(pressures_pa, time_s)
        self.device.write(self.alter_write(pressures_pa), time_s)
        return pressures_pa

    def vent(self, time_s: float) -> None:
        self.setpoints.append((time_s, np.zeros((self.arm.n_sections, 3))))
        self.device.vent(time_s)

    def close(self) -> None:
        self.device.close()

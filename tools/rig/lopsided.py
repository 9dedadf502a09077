"""A simulated arm whose valves are slow, and fill at another pace than they exhaust."""

from dataclasses import replace
from math import exp

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.hardware.simulator.adapter import SimulatedArm
from pneuarm.hardware.simulator.parameters import SimulatorParameters
from pneuarm.hardware.simulator.pneumatics import Valve


class LopsidedValve(Valve):
    """A valve with a lag (s) of its own for a pressure that goes away from zero, and one back."""

    filling_s = exhausting_s = 0.06

    def _relax(self, duration_s: float) -> None:
        if duration_s <= 0.0:
            return
        wanted, now = self._play.output, self.pressures_pa
        lag_s: Array = np.where(np.abs(wanted) > np.abs(now), self.filling_s, self.exhausting_s)
        rest = np.vectorize(exp)(-duration_s / lag_s)
        self.pressures_pa = wanted + rest * (now - wanted)


class LopsidedArm(SimulatedArm):
    """The simulated arm of a seed, behind such valves."""

    def __init__(self, arm: Arm, seed: int, filling_s: float, exhausting_s: float) -> None:
        nominal = replace(SimulatorParameters(), valve_time_constant_s=filling_s)
        super().__init__(arm, nominal, seed)
        self._filling_s, self._exhausting_s = filling_s, exhausting_s

    def connect(self) -> None:
        """Connect, with the other valves."""
        super().connect()
        self._valve = LopsidedValve(self._arm, self.drawn.values)
        self._valve.filling_s, self._valve.exhausting_s = self._filling_s, self._exhausting_s

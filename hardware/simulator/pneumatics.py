"""The air between a command and a chamber's lengthening: valves, and chambers that remember."""

from collections import deque
from math import exp

import numpy as np

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.hardware.simulator.parameters import SimulatorParameters


class Play:
    """Hysteresis of a mechanical play: the output follows the input at most ``half_width`` off.

    Up and down the same ramp the outputs differ by twice that, the width of the loop.
    """

    def __init__(self, half_width: Array) -> None:
        self._half_width = half_width
        self.output = np.zeros_like(half_width)

    def follow(self, wanted: Array) -> Array:
        """Move the output as little as the play allows; return it, a new array."""
        least, largest = wanted - self._half_width, wanted + self._half_width
        self.output = np.minimum(np.maximum(self.output, least), largest)
        return self.output

    def release(self) -> None:
        """Put the output to zero."""
        self.output = np.zeros_like(self.output)


def _half_loop_pa(arm: Arm, fraction: float) -> Array:
    """Half the width of a hysteresis loop of ``fraction`` of the range, (n_sections, 3)."""
    low, high = arm.per_chamber("pressure_min_pa"), arm.per_chamber("pressure_max_pa")
    return 0.5 * fraction * (high - low)


class Valve:
    """A proportional pressure valve a chamber: delay, resolution, hysteresis, first-order lag.

    ``pressures_pa`` (n_sections, 3) are the true gauge pressures at the time last advanced to.
    """

    def __init__(self, arm: Arm, values: SimulatorParameters) -> None:
        self._values = values
        self._play = Play(_half_loop_pa(arm, values.valve_hysteresis_fraction))
        self._pending: deque[tuple[float, Array | None]] = deque()
        self._is_venting = False
        self.pressures_pa = np.zeros((arm.n_sections, 3))

    def command(self, pressures_pa: Array, time_s: float) -> None:
        """Take setpoints (n_sections, 3) at ``time_s``; they act after the delay."""
        resolution = self._values.valve_resolution_pa
        due_s = time_s + self._values.valve_delay_s
        self._pending.append((due_s, resolution * np.rint(pressures_pa / resolution)))

    def vent(self, time_s: float) -> None:
        """Open to ambient after the delay, past resolution and hysteresis: the seat is lifted."""
        self._pending.append((time_s + self._values.valve_delay_s, None))

    def advance(self, from_s: float, to_s: float) -> None:
        """Follow the setpoints from one time to the other."""
        while self._pending and self._pending[0][0] <= to_s:
            due_s, setpoints = self._pending.popleft()
            self._relax(due_s - from_s)
            from_s = max(from_s, due_s)
            self._is_venting = setpoints is None
            if setpoints is None:
                self._play.release()
            else:
                self._play.follow(setpoints)
        self._relax(to_s - from_s)

    def _relax(self, duration_s: float) -> None:
        """Let time pass without anything new: here exactly, for steps of any length."""
        if duration_s > 0.0:
            rest = exp(-duration_s / self._values.valve_time_constant_s)
            self.pressures_pa = self._play.output + rest * (self.pressures_pa - self._play.output)


class Chamber:
    """Pressure to lengthening: hysteresis in the walls, the calibrated map, then slow creep.

    ``lengthening_m`` (n_sections, 3) is what the chambers would do without any load.
    """

    def __init__(self, arm: Arm, values: SimulatorParameters) -> None:
        self._values = values
        self._map = PressureMap(arm)
        self._rest_m = arm.rest_lengths_m
        self._play = Play(_half_loop_pa(arm, values.chamber_hysteresis_fraction))
        self._creep_m = np.zeros((arm.n_sections, 3))
        self.lengthening_m = np.zeros((arm.n_sections, 3))

    def advance(self, pressures_pa: Array, step_s: float) -> None:
        """Take the pressures (n_sections, 3) for ``step_s``."""
        prompt_m = self._map.lengths_m(self._play.follow(pressures_pa)) - self._rest_m
        rest = exp(-step_s / self._values.creep_time_constant_s)
        final_m = self._values.creep_fraction * prompt_m
        self._creep_m = final_m + rest * (self._creep_m - final_m)
        self.lengthening_m = prompt_m + self._creep_m

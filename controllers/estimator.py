"""Chamber lengths and tip pose from what is measured."""

import numpy as np

from controllers.actuation import PressureMap
from controllers.arm import Arm, Array
from controllers.kinematics.compiled import CompiledKinematics, TipState


class Estimator:
    """Lengths from a length sensor where there is one, else from the pressure through the map.

    The tip pose follows by constant curvature; what load does to the arm is not in it.
    """

    def __init__(self, arm: Arm) -> None:
        self._pressure_map = PressureMap(arm)
        self._kinematics = CompiledKinematics(arm)

    def lengths_m(self, pressures_pa: Array, measured_lengths_m: Array) -> Array:
        """Best lengths (n_sections, 3); ``measured_lengths_m`` is NaN where nothing measures."""
        from_pressure = self._pressure_map.lengths_m(pressures_pa)
        return np.where(np.isnan(measured_lengths_m), from_pressure, measured_lengths_m)

    def tip(self, lengths_m: Array) -> TipState:
        """Tip pose for the lengths; the arrays are reused by the next call."""
        return self._kinematics.evaluate(lengths_m)

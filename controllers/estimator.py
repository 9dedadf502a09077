"""Chamber lengths and tip pose from what is measured."""

import numpy as np

from controllers.actuation import PressureMap
from controllers.arm import Arm, Array
from controllers.kinematics.compiled import CompiledKinematics, TipState


class Estimator:
    """Lengths from a length sensor where there is one, else from the pressure through the map.

    The tip pose follows by constant curvature; load and coupling are in it where they are
    calibrated, hysteresis is not.
    """

    def __init__(self, arm: Arm) -> None:
        self._pressure_map = PressureMap(arm)
        self._near_m: Array | None = None
        self._kinematics = CompiledKinematics(arm)

    def lengths_m(self, pressures_pa: Array, measured_lengths_m: Array) -> Array:
        """Best lengths (n_sections, 3); ``measured_lengths_m`` is NaN where nothing measures."""
        from_pressure = self._pressure_map.lengths_m(pressures_pa, self._near_m)
        self._near_m = from_pressure if self._pressure_map.converged else None
        return np.where(np.isnan(measured_lengths_m), from_pressure, measured_lengths_m)

    def tip(self, lengths_m: Array) -> TipState:
        """Tip pose for the lengths; the arrays are reused by the next call."""
        return self._kinematics.evaluate(lengths_m)

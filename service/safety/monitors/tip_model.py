"""Where the model alone has the tip, to compare a measured one with."""

import numpy as np

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.compiled import CompiledKinematics

#: An older measurement of the tip says nothing about the present.
OLDEST_S = 0.2


class TipModel:
    """Pressures to tip by the map and constant curvature; no measurement of the tip is in it."""

    def __init__(self, arm: Arm) -> None:
        self._pressure_map = PressureMap(arm)
        self._kinematics = CompiledKinematics(arm)
        self._received_ns = 0
        self._error_m = np.nan

    def error_m(
        self, position_m: Array, received_ns: int, pressures_pa: Array, now_ns: int
    ) -> float:
        """Distance of a measured tip (3,) from the model's, once a measurement; NaN if old."""
        if received_ns != self._received_ns:
            self._received_ns = received_ns
            tip = self._kinematics.evaluate(self._pressure_map.lengths_m(pressures_pa))
            self._error_m = float(np.linalg.norm(position_m - tip.position_m))
        return self._error_m if (now_ns - received_ns) * 1e-9 <= OLDEST_S else np.nan

"""Measured lengths and a measured tip against the model."""

import numpy as np

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm
from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.monitor import Observation, Persistence, chamber


class ModelHolds:
    """Lengths against those of the measured pressures; the tip against the estimated one.

    The tolerances must leave room for what the model does not know: load, creep and swinging.
    """

    code = FaultCode.MODEL_CONTRADICTED

    def __init__(
        self, arm: Arm, length_tolerance_m: float, tip_tolerance_m: float, lasting_s: float
    ) -> None:
        self._length_tolerance_m, self._tip_tolerance_m = length_tolerance_m, tip_tolerance_m
        self._lasting_s = lasting_s
        self._pressure_map = PressureMap(arm)
        self._lasting = Persistence()

    def look(self, seen: Observation) -> str:
        """Tell which measurement is how far off."""
        what = ""
        if seen.tip_error_m > self._tip_tolerance_m:  # false of NaN: nothing measures the tip
            off_mm, allowed_mm = 1e3 * seen.tip_error_m, 1e3 * self._tip_tolerance_m
            what = f"the measured tip is {off_mm:.0f} mm from the model's (allowed: {allowed_mm:g})"
        elif any(length == length for length in seen.lengths_m):
            what = self._length_that_is_off(seen)
        return what if self._lasting.longer(bool(what), seen.now_s, self._lasting_s) else ""

    def _length_that_is_off(self, seen: Observation) -> str:
        pressures_pa = np.reshape(seen.measured_pa, (-1, 3))
        models_m = self._pressure_map.lengths_m(pressures_pa).ravel().tolist()
        for index, (length_m, model_m) in enumerate(zip(seen.lengths_m, models_m, strict=True)):
            if abs(length_m - model_m) > self._length_tolerance_m:
                length_mm, off_mm = 1e3 * length_m, 1e3 * abs(length_m - model_m)
                return (
                    f"{chamber(index)} measures {length_mm:.0f} mm, {off_mm:.0f} mm from the "
                    f"model's length (allowed: {1e3 * self._length_tolerance_m:g})"
                )
        return ""

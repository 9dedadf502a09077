"""Measured lengths and a measured tip against the model."""

from controllers.arm import Arm
from service.faults import FaultCode
from service.monitors.monitor import Lasting, Seen, chamber


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
        self._rest_m = arm.rest_lengths_m.reshape(-1).tolist()
        self._linear = arm.per_chamber("lengthening_m_per_pa").reshape(-1).tolist()
        self._quadratic = arm.per_chamber("softening_m_per_pa2").reshape(-1).tolist()
        self._lasting = Lasting()

    def look(self, seen: Seen) -> str:
        """Tell which measurement is how far off."""
        what = ""
        if seen.tip_error_m > self._tip_tolerance_m:  # false of NaN: nothing measures the tip
            off_mm, allowed_mm = 1e3 * seen.tip_error_m, 1e3 * self._tip_tolerance_m
            what = f"the measured tip is {off_mm:.0f} mm from the model's (allowed: {allowed_mm:g})"
        elif any(length == length for length in seen.lengths_m):
            what = self._length_that_is_off(seen)
        return what if self._lasting.longer(bool(what), seen.now_s, self._lasting_s) else ""

    def _length_that_is_off(self, seen: Seen) -> str:
        for index, (length, pressure) in enumerate(
            zip(seen.lengths_m, seen.measured_pa, strict=True)
        ):
            factor = self._linear[index] + self._quadratic[index] * abs(pressure)
            off_m = abs(length - self._rest_m[index] - pressure * factor)
            if off_m > self._length_tolerance_m:
                allowed_mm = 1e3 * self._length_tolerance_m
                return (
                    f"{chamber(index)} measures {1e3 * length:.0f} mm, {1e3 * off_m:.0f} mm from "
                    f"the model's length (allowed: {allowed_mm:g})"
                )
        return ""

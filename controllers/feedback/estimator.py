"""Chamber lengths and tip pose from what is measured."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.feedback.observer import TipObserver
from pneuarm.controllers.kinematics.compiled import CompiledKinematics, TipState


class EstimateSource(IntEnum):
    """What an estimated tip pose rests on, numbered as on the wire."""

    NONE = 0
    PRESSURES = 1
    LENGTHS = 2
    TIP_POSE = 3


@dataclass(slots=True)
class TipEstimate:
    """Tip pose: position (3,), rotation (3, 3), standard deviation in m, and its source."""

    position_m: Array
    rotation: Array
    sigma_m: float
    source: EstimateSource


class Estimator:
    """Lengths from a length sensor where there is one, else from the pressure through the map.

    The tip follows by constant curvature, load and coupling in it where they are calibrated,
    hysteresis not; corrected by what motion capture has taught. While that sees the tip, it is
    where the response to the commands and the newest pose say.
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

    def tip_estimate(
        self, lengths_m: Array, measured_lengths_m: Array, observer: TipObserver
    ) -> TipEstimate:
        """Tip pose from the best that there is now."""
        if observer.seen:
            position, rotation = observer.estimate()
            return TipEstimate(position, rotation, observer.sigma_m, EstimateSource.TIP_POSE)
        tip = self._kinematics.evaluate(lengths_m)
        sensors = not np.isnan(measured_lengths_m).any()
        return TipEstimate(
            tip.position_m + observer.offset_m,
            observer.rotation @ tip.rotation,
            min(observer.sigma_m, observer.length_sigma_m) if sensors else observer.sigma_m,
            EstimateSource.LENGTHS if sensors else EstimateSource.PRESSURES,
        )

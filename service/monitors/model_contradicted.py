"""Measured lengths and a measured tip against the model."""

import math
from typing import Annotated

import numpy as np
from pydantic import Field

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.compiled import CompiledKinematics
from pneuarm.hardware.tables.table import MM, Positive, Table
from pneuarm.service.monitors.fault import Fault, Policy
from pneuarm.service.monitors.monitor import (
    MS,
    PERCENT,
    Lasting,
    Monitor,
    Observation,
    Persistence,
    chamber,
)

#: An older measurement of the tip says nothing about the present.
OLDEST_S = 0.2

#: A measured length stands still that has gone less than this share of what the model's has gone.
_STILL_SHARE = 0.1


class TipModel:
    """Pressures to tip by the map and constant curvature; no measurement of the tip is in it."""

    def __init__(self, arm: Arm) -> None:
        self._pressure_map = PressureMap(arm)
        self._kinematics = CompiledKinematics(arm)
        self._received_ns: int | None = None

    def error_m(
        self, position_m: Array, received_ns: int, pressures_pa: Array, now_ns: int
    ) -> float:
        """Distance of a measured tip (3,) from the model's, once a measurement; NaN if old."""
        if received_ns != self._received_ns:
            self._received_ns = received_ns
            tip = self._kinematics.evaluate(self._pressure_map.lengths_m(pressures_pa))
            self._error_m = math.dist(position_m, tip.position_m)
        return self._error_m if (now_ns - received_ns) * 1e-9 <= OLDEST_S else math.nan


class ModelContradictedKeys(Table):
    """When what is measured of the arm's shape contradicts the model of its pressures."""

    length_tolerance_mm: Annotated[
        Positive,
        Field(description="how far a measured chamber length may be from the model's"),
    ] = 60.0
    length_still_mm: Annotated[
        Positive,
        Field(
            description=(
                "how far a chamber length may go by the model while the measured one goes less "
                "than a tenth of that: its sensor stands still"
            )
        ),
    ] = 10.0
    tip_tolerance_percent: Annotated[
        Positive,
        Field(
            description=(
                "how far a measured tip may be from the model's, in percent of the arm's length "
                "at rest"
            )
        ),
    ] = 75.0
    lasting_ms: Lasting = 500.0


class ModelContradicted(Monitor):
    """Lengths against those of the measured pressures; the tip against the estimated one.

    The tolerances must leave room for what the model does not know: load, creep and swinging. A
    length that stands still while its pressures say that it moves is told long before: it may
    stand near the middle of all moves.
    """

    fault = Fault(
        "model_contradicted",
        9,
        Policy.HOLD,
        "measured lengths or tip pose contradict the model: a slipped or dead sensor, a slipped "
        "marker, a wrong frame, a burst chamber, something in the arm's way",
        "look at the arm and at what measures it, then enable again",
    )
    looks_at = "measured lengths and tip against the model of the measured pressures"
    how_to_set = (
        "above what load, creep and swinging do to your arm; in their fastest moves the simulated "
        "arms swing more than half their length off for half a second, which is what the default "
        "allows for; an arm that moves slowly needs much less. `length_still_mm` above the "
        "hysteresis of the chambers, and above what an arm may be pressed that something holds"
    )
    keys = ModelContradictedKeys

    def __init__(self, arm: Arm, keys: ModelContradictedKeys) -> None:
        self._length_tolerance_m = keys.length_tolerance_mm * MM
        self._still_m = keys.length_still_mm * MM
        #: Of every chamber: where its length was when it last moved, and between which lengths the
        #: model's has been since.
        self._stood = [(np.nan, np.nan, np.nan)] * arm.n_chambers
        self._tip_tolerance_m = PERCENT * keys.tip_tolerance_percent * arm.total_rest_length_m
        self._lasting_s = keys.lasting_ms * MS
        self._pressure_map = PressureMap(arm)
        self._persistence = Persistence()

    def look(self, seen: Observation) -> str:
        """Tell which measurement is how far off."""
        what = ""
        if seen.tip_error_m > self._tip_tolerance_m:  # false of NaN: nothing measures the tip
            off_mm, allowed_mm = 1e3 * seen.tip_error_m, 1e3 * self._tip_tolerance_m
            what = f"the measured tip is {off_mm:.0f} mm from the model's (allowed: {allowed_mm:g})"
        elif any(length == length for length in seen.lengths_m):
            what = self._length_that_is_off(seen)
        return what if self._persistence.longer(what != "", seen.now_s, self._lasting_s) else ""

    def _length_that_is_off(self, seen: Observation) -> str:
        pressures_pa = np.reshape(seen.measured_pa, (-1, 3))
        models_m = self._pressure_map.lengths_m(pressures_pa).ravel().tolist()
        what = self._length_that_stands(seen.lengths_m, models_m)
        for index, (length_m, model_m) in enumerate(zip(seen.lengths_m, models_m, strict=True)):
            if abs(length_m - model_m) > self._length_tolerance_m:
                length_mm, off_mm = 1e3 * length_m, 1e3 * abs(length_m - model_m)
                return (
                    f"{chamber(index)} measures {length_mm:.0f} mm, {off_mm:.0f} mm from the "
                    f"model's length (allowed: {1e3 * self._length_tolerance_m:g})"
                )
        return what

    def _length_that_stands(self, lengths_m: list[float], models_m: list[float]) -> str:
        what = ""
        for index, (length_m, model_m) in enumerate(zip(lengths_m, models_m, strict=True)):
            from_m, low_m, high_m = self._stood[index]
            stands = abs(length_m - from_m) <= _STILL_SHARE * self._still_m  # false of NaN
            if not stands or low_m != low_m:
                from_m, low_m, high_m = length_m, model_m, model_m
            low_m, high_m = min(low_m, model_m), max(high_m, model_m)
            self._stood[index] = from_m, low_m, high_m
            if high_m - low_m > self._still_m:
                what = (
                    f"{chamber(index)} stands at {1e3 * length_m:.0f} mm while its pressures moved "
                    f"it by {1e3 * (high_m - low_m):.0f} mm (allowed: {1e3 * self._still_m:g})"
                )
        return what

"""Whether a measured tip goes along with what the arm is told."""

import math

from pneuarm.controllers.arm.arm import Array

#: Of the way that the model's tip has gone, the measured one has gone this share at least.
_LEAST_SHARE = 0.1

#: Within this share of the way the expected tip is still where the comparison began.
_NEAR_SHARE = 0.2

#: A swing or a stiction that lasts no longer (s) than this says nothing about the sensor.
_LASTING_S = 0.3


class GoesAlong:
    """Compares both ways from where they last agreed: their share, along those ways.

    A sensor that stands still has gone nothing of it, one with a sign or axes exchanged the other
    way or across. A tip that something holds looks the same, and is to be corrected as little.
    """

    def __init__(self, way_m: float) -> None:
        self._way_m = way_m
        self._from: tuple[Array, Array, Array] | None = None
        self._against_s = self._near_s = 0.0
        self.believed = True
        #: Whether the newest look has begun to compare anew: both have gone together until then.
        self.agreed = False

    @property
    def near(self) -> bool:
        """Whether the expected tip is still where the comparison began: nothing can be told yet."""
        return self._near_s > 0.0

    @property
    def stands(self) -> bool:
        """Whether it has been there for long."""
        return self._near_s > _LASTING_S

    def look(
        self, measured_m: Array, predicted_m: Array, corrected_m: Array, pause_s: float
    ) -> bool:
        """Take tips (3,) of one time, and how long (s) it is since the last.

        ``predicted_m`` is the model's, ``corrected_m`` that with the correction. What only the
        correction moves is no way that the tip must go: a load moves the first while the tip
        stands, a correction that grows the second. Return whether the sensor is believed.
        """
        self.agreed = self._from is None
        tips = (measured_m, predicted_m, corrected_m)
        if self._from is None:
            self._from = tips
        measured, *ways = (now - then for now, then in zip(tips, self._from, strict=True))
        shortest_m = min(math.sqrt(way @ way) for way in ways)
        near = self.agreed or shortest_m < _NEAR_SHARE * self._way_m
        self._near_s = self._near_s + pause_s if near else 0.0
        if shortest_m < self._way_m:
            self._against_s = 0.0
        elif any(measured @ way >= _LEAST_SHARE * (way @ way) for way in ways):
            self._from, self._against_s = tips, 0.0
            self.believed = self.agreed = True
        else:
            self._against_s += pause_s
            self.believed = self.believed and self._against_s <= _LASTING_S
        return self.believed

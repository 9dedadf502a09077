"""The colours of the live view: one meaning, one colour, in the 3D scene and in every plot.

Blue and red are kept for the chambers' length against its bounds, so nothing else uses them.
"""

import numpy as np
from numpy.typing import NDArray

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.logs.schema import pneuarm_pb2 as pb

Color = tuple[int, int, int]

#: Chambers 1, 2 and 3 of every section: bright what is measured, dark what is commanded.
CHAMBERS: tuple[Color, Color, Color] = ((245, 160, 40), (70, 200, 120), (180, 130, 245))
CHAMBERS_COMMANDED: tuple[Color, Color, Color] = ((124, 86, 34), (44, 106, 68), (94, 72, 126))

BOUND: Color = (120, 120, 120)
PLATE: Color = (150, 155, 160)
BACKBONE: Color = (165, 130, 95)
TRAIL: Color = (40, 130, 140)
TARGET: Color = (255, 215, 50)
TARGET_OUT_OF_REACH: Color = (255, 70, 180)
TIP_TRUE: Color = (40, 220, 230)
TIP_MEASURED: Color = (255, 255, 255)
TIP_ESTIMATED: Color = (220, 175, 125)
TIP_COMMANDED: Color = (130, 130, 130)
WAKE: Color = (120, 190, 190)
COMPUTE: Color = (215, 190, 140)
OVERRUN: Color = (255, 60, 60)

MODES: dict[int, Color] = {
    pb.IDLE: (95, 100, 110),
    pb.READY: (70, 115, 150),
    pb.ACTIVE: (50, 140, 80),
    pb.HOLD: (180, 140, 40),
    pb.FAULT: (200, 60, 50),
    pb.ESTOP: (200, 40, 110),
}

_SHORTEST = np.array([40.0, 110.0, 255.0])
_REST = np.array([225.0, 225.0, 225.0])
_LONGEST = np.array([255.0, 50.0, 40.0])


class LengthColors:
    """Colours of the chambers of one arm by their length."""

    def __init__(self, arm: Arm) -> None:
        low, high = length_bounds_m(arm)
        self._rest_m = arm.rest_lengths_m
        # Without vacuum the rest length is the lower bound: a micrometre keeps the quotient finite.
        self._shortening_m = np.maximum(self._rest_m - low, 1e-6)
        self._lengthening_m = np.maximum(high - self._rest_m, 1e-6)

    def of(self, lengths_m: Array) -> NDArray[np.uint8]:
        """Return RGB ``(n_chambers, 3)`` for lengths ``(n_sections, 3)``.

        Light grey at rest, blue at and below the lower bound, red at and above the upper one.
        """
        change = lengths_m - self._rest_m
        span = np.where(change < 0.0, self._shortening_m, self._lengthening_m)
        share = np.clip(change / span, -1.0, 1.0).reshape(-1, 1)
        end = np.where(share < 0.0, _SHORTEST, _LONGEST)
        rgb: Array = np.round(_REST + np.abs(share) * (end - _REST))
        return rgb.astype(np.uint8)

"""Whether a measured tip swings around where it is to be, and does not cease to.

A correction whose model is wrong, by dead time above all, feeds a swing that does not die out. It
is told from one that does by its turns: so many in a row along an axis, over seconds, each way
between them larger than what counts as standing and what the camera's noise explains, all of about
one size, and one period as long as the next.
Where the tip is to move, its valves and chambers turn with the reference, and its error with them:
a swing turns more than twice as often as the reference's acceleration changes its sign along its
three axes. On a circle it is seen if it is four times as quick.
"""

import math
from collections import deque
from collections.abc import Collection

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.geometry.moving_point import MovingPoint

#: So many ways in a row are a swing whose smallest is at least this share of the largest, and its
#: shortest period of the longest. A mode of damping ratio z leaves exp(-pi z) from one way to the
#: next: one above 0.03 dies out sooner.
_WAYS, _ALIKE_SHARE = 5, 0.7

#: Nor is it one before it has lasted so long (s): a move excites the mode until it ends. So many
#: ways are remembered.
_LASTS_S, _REMEMBERED = 2.0, 64

#: A way that is longer than so many standard deviations of the camera's noise is none of it. They
#: are found over about so many poses.
_NOISE_TIMES, _NOISE_POSES = 8.0, 20

#: Fourth differences of poses: a motion leaves little in them, noise of one variance 70 times it. A
#: swing is seen where the camera takes eight poses a period.
_DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0])


class _Axis:
    """One coordinate of the tip, and the ways between its turns."""

    def __init__(self, position_m: float) -> None:
        self._turn_m = self._far_m = position_m
        self._sign = 0.0
        self.ways_m: deque[float] = deque(maxlen=_REMEMBERED)
        self._turned_s: deque[float] = deque(maxlen=_REMEMBERED)

    def look(self, position_m: float, at_s: float, least_m: float) -> list[float]:
        """Take a position; return the times of the turns of a lasting swing that turns now."""
        if self._sign == 0.0 and abs(position_m - self._turn_m) > least_m:
            self._sign = 1.0 if position_m > self._turn_m else -1.0
        if self._sign * (position_m - self._far_m) >= 0.0:
            self._far_m = position_m
            return []
        if abs(position_m - self._far_m) <= least_m:
            return []
        self.ways_m.append(abs(self._far_m - self._turn_m))
        self._turned_s.append(at_s)
        self._turn_m, self._far_m, self._sign = self._far_m, position_m, -self._sign
        turned_s = _lasting(list(self._turned_s))
        ways_m = list(self.ways_m)[-len(turned_s) :]
        return turned_s if turned_s and _alike(ways_m) and _alike(_periods_s(turned_s)) else []


def _lasting(turned_s: list[float]) -> list[float]:
    """The newest of the turns that are so many and last so long; none where none do."""
    for number in range(_WAYS, len(turned_s) + 1):
        if turned_s[-1] - turned_s[-number] >= _LASTS_S:
            return turned_s[-number:]
    return []


def _periods_s(turned_s: list[float]) -> list[float]:
    """From each turn to the one after the next."""
    return [after - before for before, after in zip(turned_s, turned_s[2:], strict=False)]


def _alike(values: Collection[float]) -> bool:
    return min(values) >= _ALIKE_SHARE * max(values)


class SwingWatch:
    """Looks at a measured tip; a way from turn to turn of ``least_m`` is the smallest that counts.

    ``way_m`` and ``period_s`` are of the swing that was found last.
    """

    def __init__(self, least_m: float) -> None:
        self._least_m = least_m
        self.way_m = self.period_s = 0.0
        self.begin_anew()

    def begin_anew(self) -> None:
        """Take the next tip as the first one."""
        self._axes: list[_Axis] = []
        self._newest_m: deque[Array] = deque(maxlen=len(_DIFFERENCE))
        self._variance_m2 = np.zeros(3)
        self._signs = [0.0, 0.0, 0.0]
        #: When the wanted acceleration has changed its sign.
        self._changed_s: deque[float] = deque(maxlen=_REMEMBERED)
        self._at_s, self._poses = 0.0, 0

    def look(self, position_m: Array, wanted: MovingPoint, pause_s: float) -> bool:
        """Take a tip (3,), where it is wanted, and the time since the last tip.

        Return whether a swing is found, anew.
        """
        self._at_s += pause_s
        self._follow(wanted.acceleration)
        off_m = position_m - wanted.position[:3]
        self._axes = self._axes or [_Axis(value_m) for value_m in off_m.tolist()]
        least_m = max(self._least_m, _NOISE_TIMES * self._noise_m(off_m))
        tip = zip(self._axes, off_m.tolist(), strict=True)
        swings = [axis.look(value_m, self._at_s, least_m) for axis, value_m in tip]
        turned_s = next(filter(None, swings), None)
        if turned_s is None:
            return False
        changes = sum(changed_s > turned_s[0] for changed_s in self._changed_s)
        if 2 * changes >= len(turned_s) - 1:
            return False
        self.way_m = max(axis.ways_m[-1] for axis in self._axes if axis.ways_m)
        periods_s = _periods_s(turned_s)
        self.period_s = sum(periods_s) / len(periods_s)
        self.begin_anew()
        return True

    def _follow(self, acceleration: list[float]) -> None:
        """See whether the wanted acceleration, of three axes or more, has changed its sign."""
        for axis, value in enumerate(acceleration[:3]):
            if value * self._signs[axis] < 0.0:
                self._changed_s.append(self._at_s)
            if value != 0.0:
                self._signs[axis] = math.copysign(1.0, value)

    def _noise_m(self, position_m: Array) -> float:
        """Learn the camera's noise; return its standard deviation along the worst axis."""
        self._newest_m.append(position_m)
        if len(self._newest_m) == len(_DIFFERENCE):
            self._poses += 1
            difference_m = _DIFFERENCE @ np.stack(self._newest_m)
            news_m2 = difference_m**2 / (_DIFFERENCE @ _DIFFERENCE) - self._variance_m2
            self._variance_m2 = self._variance_m2 + news_m2 / min(self._poses, _NOISE_POSES)
        return math.sqrt(self._variance_m2.max())

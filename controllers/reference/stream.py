"""Positions that arrive one after another: how fast what they follow moves."""

import math
from collections import deque

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.targets.same import SAME

#: Positions that arrive this close together (s) and move are a stream; without the next one for
#: as long, the reference goes to the last one and stands.
STREAM_S = 0.1

#: Share of the newest step in the speed of a stream: arrival times jitter.
_NEWEST = 0.4

#: Positions (m) this near are one that comes again: single precision rounds by less. So are those
#: within this share of the step before, up to SAME: programs add noise to what they send again.
_AGAIN_M, _AGAIN_SHARE = 1e-7, 0.02

#: A position that comes again stands, when it has been there for so many times the last step's
#: time; before that its source has only not measured the next one yet.
_NEXT_IS_DUE = 1.6


class Stream:
    """The speed of positions that arrive one after another.

    A program may send faster than its positions change: what comes again in between is the old
    position still, and the speed then is that over all changes within ``STREAM_S``.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """The next position is the first."""
        self._changes: deque[tuple[float, Array]] = deque()
        self._heard_s = self._step_s = self._step_m = 0.0
        self._velocity: Array | None = None
        self._told = np.zeros(3)
        self.waits, self._again_s = False, -math.inf

    def velocity(self, position_m: Array, at_s: float, largest_m_s: float) -> Array:
        """Speed (3,) of a stream; zero for a position that stands or comes alone.

        ``waits`` says that the position is the one before, and the next one is still to come.
        """
        pause_s, self._heard_s = at_s - self._heard_s, at_s
        again_m = max(_AGAIN_M, min(SAME, _AGAIN_SHARE * self._step_m))
        if self._changes and float(np.abs(position_m - self._changes[-1][1]).max()) <= again_m:
            return self._repeated(at_s)
        self.waits = False
        self._told = self._changed(position_m, at_s, pause_s, largest_m_s)
        return self._told

    def _repeated(self, at_s: float) -> Array:
        age_s = at_s - self._changes[-1][0]
        self.waits = self._velocity is not None and age_s <= _NEXT_IS_DUE * self._step_s
        if self.waits:
            self._again_s = at_s
        else:
            self._velocity, self._told = None, np.zeros(3)
        return self._told

    def _changed(self, position_m: Array, at_s: float, pause_s: float, largest_m_s: float) -> Array:
        changes = self._changes
        if changes and at_s - changes[-1][0] <= STREAM_S:
            pause_s = at_s - changes[-1][0]
        if not changes or not 0.0 < pause_s <= STREAM_S:
            self._begin(position_m, at_s)
            return np.zeros(3)
        self._step_s = pause_s
        newest = (position_m - changes[-1][1]) / pause_s
        self._step_m = pause_s * float(np.abs(newest).max())
        if not self._step_m <= pause_s * largest_m_s:
            self._begin(position_m, at_s)
            return np.zeros(3)
        changes.append((at_s, position_m))
        while at_s - changes[0][0] > STREAM_S + 1e-9 and len(changes) > 2:
            changes.popleft()
        known = self._velocity
        if at_s - self._again_s <= STREAM_S and known is not None:
            first_s, first_m = changes[0]
            self._velocity = (position_m - first_m) / (at_s - first_s)
        else:
            self._velocity = newest if known is None else known + _NEWEST * (newest - known)
        return np.zeros(3) if known is None else self._velocity

    def _begin(self, position_m: Array, at_s: float) -> None:
        self._changes.clear()
        self._changes.append((at_s, position_m))
        self._velocity, self._again_s, self._step_m = None, -math.inf, 0.0

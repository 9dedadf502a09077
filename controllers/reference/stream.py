"""Positions that arrive one after another: how fast what they follow moves."""

import numpy as np

from pneuarm.controllers.arm.arm import Array

#: Positions that arrive this close together (s) and move are a stream; without the next one for
#: as long, the reference goes to the last one and stands.
STREAM_S = 0.1

#: Share of the newest step in the speed of a stream: arrival times jitter.
_NEWEST = 0.4


class Stream:
    """The speed of positions that arrive one after another."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """The next position is the first."""
        self._position: Array | None = None
        self._at_s = 0.0
        self._velocity: Array | None = None

    def velocity(self, position_m: Array, at_s: float, largest_m_s: float) -> Array:
        """Speed (3,) of a stream; zero for a position that is repeated or stands alone."""
        before, pause_s = self._position, at_s - self._at_s
        self._position, self._at_s = position_m, at_s
        if before is None or not 0.0 < pause_s <= STREAM_S:
            self._velocity = None
            return np.zeros(3)
        newest = (position_m - before) / pause_s
        if not 0.0 < float(np.abs(newest).max()) <= largest_m_s:
            self._velocity = None
            return np.zeros(3)
        known = self._velocity
        self._velocity = newest if known is None else known + _NEWEST * (newest - known)
        return np.zeros(3) if known is None else self._velocity

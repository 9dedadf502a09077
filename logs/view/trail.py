"""Where the tip was in the last seconds."""

from collections import deque

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.logs.view.geometry import Points

TRAIL_NS = 5_000_000_000
_SPACING_NS = 20_000_000


class Trail:
    """The tip's last 5 s, one position every 20 ms: at most 251 of them."""

    def __init__(self) -> None:
        self._points: deque[tuple[int, Array]] = deque()

    def add(self, ticks: np.ndarray) -> None:
        """Append the tips of ticks, shape (n,): the true one, else measured, else estimated."""
        slots = ticks["time_unix_ns"] // _SPACING_NS
        last = self._points[-1][0] // _SPACING_NS if self._points else -1
        for tick in ticks[np.diff(slots, prepend=last) != 0]:
            position_m = _best_tip(tick)
            if not np.isnan(position_m).any():
                self._append(int(tick["time_unix_ns"]), position_m)

    def _append(self, time_ns: int, position_m: Array) -> None:
        if self._points and time_ns < self._points[-1][0]:
            self._points.clear()  # a replay that has jumped back
        self._points.append((time_ns, position_m.copy()))
        while self._points[0][0] < time_ns - TRAIL_NS:
            self._points.popleft()

    def positions_m(self) -> Points:
        """Return the positions, oldest first, (n, 3)."""
        positions_m = [position_m for _, position_m in self._points]
        return np.array(positions_m, dtype=np.float32).reshape(-1, 3)


def _best_tip(tick: np.void) -> Array:
    for tip in ("true", "measured"):
        position_m: Array = tick[f"tip_{tip}_position_m"]
        if not np.isnan(position_m).any():
            return position_m
    estimated_m: Array = tick["tip_estimated_position_m"]
    return estimated_m

"""A trajectory that is repeated, and the same with its tip wanted elsewhere by what was learnt."""

import hashlib
import math

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import InvalidInput, LearningError, TrialLost
from pneuarm.controllers.targets.trajectory import MAX_WAYPOINTS, TrajectoryTarget

#: The tip stands this long (s) before and after: what is learnt begins before the motion does.
MARGIN_S = 0.5

#: What is learnt is sampled this finely (s), and sent in waypoints this far apart (s) or farther.
STEP_S = 0.02
_WAYPOINT_S = 0.05

#: Waypoints that leave the wanted way by more (m) do not stand for it.
_FAITHFUL_M = 1e-3

#: Between two measured tips there is no longer than this (s).
_GAP_S = 0.25


class Course:
    """One trajectory on an even grid of time; all times count from the beginning of what is sent.

    ``times_s`` (n,) is the grid, ``wanted_m`` (n, 3) where the tip is to be, ``judged`` (n,)
    whether the wanted motion itself is under way: what is before and after it counts for no error.
    ``waypoint_times_s`` are the times of what is sent.
    Raises LearningError for a trajectory that the waypoints of one message do not stand for.
    """

    def __init__(self, wanted: TrajectoryTarget) -> None:
        self._wanted = wanted
        begin_s, end_s = wanted.start_s, wanted.duration_s
        self.duration_s = end_s - begin_s + 2.0 * MARGIN_S
        number = math.ceil(self.duration_s / STEP_S) + 1
        self.times_s: Array = STEP_S * np.arange(number, dtype=np.float64)
        self.wanted_m = self._at(self.times_s)
        self.judged = (self.times_s >= MARGIN_S) & (self.times_s <= self.duration_s - MARGIN_S)
        count = min(MAX_WAYPOINTS, math.ceil(self.duration_s / _WAYPOINT_S) + 1)
        self.waypoint_times_s = np.linspace(0.0, self.duration_s, count)
        self._require_faithful()

    def _at(self, times_s: Array) -> Array:
        """Where the tip is wanted (n, 3) at times (n,)."""
        begin_s = self._wanted.start_s - MARGIN_S
        return np.array([self._wanted.at(begin_s + t).position for t in times_s.tolist()])

    def _require_faithful(self) -> None:
        sent = self.shifted(np.zeros_like(self.wanted_m))
        way = np.array([sent.at(t).position for t in self.times_s.tolist()])
        off_m = float(np.linalg.norm(way - self.wanted_m, axis=1).max())
        if off_m > _FAITHFUL_M:
            raise LearningError(
                f"the trajectory is too long or too quick to be learnt as a whole: in "
                f"{len(self.waypoint_times_s)} waypoints it would be up to {1e3 * off_m:.1f} mm "
                f"elsewhere (allowed: {1e3 * _FAITHFUL_M:g} mm); learn it in shorter pieces, or "
                "give it more time"
            )

    @property
    def waypoint_step_s(self) -> float:
        """Time between two waypoints of what is sent."""
        return float(self.waypoint_times_s[1])

    @property
    def digest(self) -> str:
        """SHA-256 of the wanted waypoints, to a nanosecond and a nanometre, in hexadecimal."""
        rows = [
            [t, *p] for t, p in zip(self._wanted.times_s, self._wanted.positions_m, strict=True)
        ]
        return hashlib.sha256(np.round(np.array(rows) * 1e9).astype("<i8").tobytes()).hexdigest()

    def shifted(self, offset_m: Array, shape_id: int = 0) -> TrajectoryTarget:
        """Return what is sent: the wanted way with offsets (n, 3) of the grid added."""
        return self.shifted_at_waypoints(self.at_waypoints(offset_m), shape_id)

    def at_waypoints(self, offset_m: Array) -> Array:
        """Offsets (waypoints, 3) of what is sent, from those of the grid (n, 3)."""
        columns = [np.interp(self.waypoint_times_s, self.times_s, c) for c in offset_m.T]
        return np.stack(columns, axis=1)

    def shifted_at_waypoints(self, offset_m: Array, shape_id: int = 0) -> TrajectoryTarget:
        """Return what is sent with an offset a waypoint (waypoints, 3); raises InvalidInput."""
        times_s = self.waypoint_times_s
        if offset_m.shape != (len(times_s), 3):
            raise InvalidInput(f"{len(offset_m)} offsets; {len(times_s)} are needed, three each")
        points = self._at(times_s) + offset_m
        return TrajectoryTarget(
            tuple(times_s.tolist()), tuple((x, y, z) for x, y, z in points.tolist()), shape_id
        )

    def on_grid(self, taken_s: Array, tip_m: Array) -> Array:
        """Measured tips (m, 3) taken at increasing times (m,) at the times of the grid (n, 3).

        Raises TrialLost where the tip was out of sight on the way.
        """
        end_s = self.times_s[-1]
        edges = np.clip(np.concatenate([[0.0], taken_s, [end_s]]), 0.0, end_s)
        gap_s = float(np.diff(edges).max())
        if gap_s > _GAP_S:
            raise TrialLost(
                f"the tip was not measured for {gap_s:.2f} s on the way (allowed: {_GAP_S:g} s), "
                "so nothing was learnt from this trial: see that the marker stays in view, and "
                "learn again"
            )
        return np.stack([np.interp(self.times_s, taken_s, c) for c in tip_m.T], axis=1)

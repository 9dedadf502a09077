"""Least squares: the parameters under which the model's tip is where the tip was measured.

Rows are the position of every rest, over ``MODEL_SD_M``, the direction of its tip, over what a fit
to the positions alone leaves of it, and one row a parameter that keeps what the motion does not
show near its nominal value. The Jacobian is exact. A body that is no arc cannot have both its
place and its direction: the place goes first, and what is left of the direction is told.

A nominal value may be wrong by ten times. What ends on a bound is where the next try begins, and
where the rests are not met from there, some other magnitudes are tried as well.
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.calibration.frames import Frames, aligned, in_base
from pneuarm.controllers.calibration.hysteresis import play_outputs, turning_points
from pneuarm.controllers.calibration.model import TipModel
from pneuarm.controllers.calibration.parameters import (
    HIGHEST,
    LOWEST,
    NAMES,
    PRIOR_SD,
    SHAPING,
    arm_of,
    span_pa,
    start_of,
)
from pneuarm.controllers.calibration.recording import AVERAGED_S, Recording, Rests, acting_pa

#: What a measured rest may differ from the best model (m): creep, swing, a body that is no arc.
MODEL_SD_M = 1.5e-3
#: The same for the direction of the tip (rad), at least and at most: in between it counts as much
#: as the model follows it.
DIRECTION_SD, LARGEST_DIRECTION_SD = 0.02, 0.06

#: Prior of the frames: turn (rad) and places (m) are free, the marker (m) sits near the tip.
_FRAMES_SD = np.array([1.0] * 3 + [1.0] * 3 + [0.03] * 3)

#: Priors of rest length and axial compliance beside them.
_LENGTHS_IN_WORLD_SD = (0.05, 0.2)

#: A parameter whose standard deviation the data reduce to below this share of the prior is seen.
SEEN_SHARE = 0.5

#: So often the fit is tried again around a parameter that ended on its bound.
_TRIES = 3
#: Evaluations of one try: a good arm needs some ten.
_EVALUATIONS = 100
#: First what is large: with priors this much tighter.
_TIGHT = 5.0
#: Rests met within this share of the arm's length, on average, are met: no other start is tried.
_MET_SHARE = 0.015
#: Magnitudes of lengthening and offset, and shares of bend lost to the weight: of these places the
#: nearest to the rests are the next starts, so many.
_MAGNITUDES = (0.1, 0.3, 1.0, 3.0, 10.0)
_COMPLIANCES = (0.0, 0.4)
_STARTS = 3
#: Far from any arm a derivative may be no number, or beyond any use.
_LARGEST = 1e6

#: The marker's z axis is that of the tip unless it is turned by more (rad) on average.
_MARKER_TURNED = 0.15

#: Folds of the rests: each is judged by a fit that did not see it.
_FOLDS = 5


@dataclass(frozen=True)
class Fit:
    """What least squares found. Tips (rests, 3) are in the measuring frame, m.

    ``theta`` and ``sd`` (n_sections, len(NAMES)) are scaled as in
    :mod:`pneuarm.controllers.calibration.parameters`; ``share`` is the sd over the prior's: what is
    near 1 was not seen in the data. ``direction_rad`` (rests,) is the angle between the modelled
    and the measured direction of the tip, NaN where none was measured; ``held_out_m`` and
    ``held_out_rad`` (rests,) are the errors of fits that did not see these rests.
    """

    arm: Arm
    frames: Frames
    theta: Array
    sd: Array
    share: Array
    pressures_pa: Array
    effective_pa: Array
    measured_m: Array
    before_m: Array
    after_m: Array
    direction_before_rad: Array
    direction_rad: Array
    held_out_m: Array
    held_out_rad: Array
    #: Which parameters (n_sections, len(NAMES)) are on a bound that is not 0, tried again or not.
    bound: NDArray[np.bool_]
    #: Whether ``frames`` were fitted; else they are those of a tip measured in the base.
    in_world: bool

    @property
    def errors_m(self) -> Array:
        """Distances (rests,) from the modelled to the measured tips."""
        distances: Array = np.linalg.norm(self.after_m - self.measured_m, axis=1)
        return distances


class _Problem:
    """The rows of one fit and their derivative, over ``x``: parameters, then frames if fitted."""

    def __init__(self, arm: Arm, recording: Recording, rests: Rests, in_world: bool) -> None:
        self.model, self.arm, self.rests = TipModel(arm), arm, rests
        acting = acting_pa(recording, arm.response)
        middle = np.searchsorted(
            recording.time_s, recording.time_s[rests.last] - 0.5 * AVERAGED_S + 1e-9
        )
        rows = turning_points(acting, middle)
        self._history_pa, self._at = acting[rows], np.searchsorted(rows, middle)
        self.pressures_pa = acting[middle]
        self._span_pa = np.array([[span_pa(section)] for section in arm.sections])
        self.start = start_of(arm)
        self._shape = self.start.shape
        self.in_world, self.frames = in_world, in_base()
        self._free = self._free_parameters(in_world)
        self.n_parameters = int(self._free.sum())
        self.sd = np.tile(PRIOR_SD, arm.n_sections)[self._free]
        self.lowest = np.tile(LOWEST, arm.n_sections)[self._free]
        self.highest = np.tile(HIGHEST, arm.n_sections)[self._free]
        self.x = self.start.reshape(-1)[self._free]
        if in_world:
            self.sd = np.append(np.minimum(self.sd, _in_world_sd(arm, self._free)), _FRAMES_SD)
            self.lowest = np.append(self.lowest, np.full(9, -np.inf))
            self.highest = np.append(self.highest, np.full(9, np.inf))
            self.x = np.append(self.x, np.zeros(9))
        self.centre, self._middle = self.x.copy(), np.where(self.lowest < 0.0, 0.0, self.x)
        self.used: NDArray[np.bool_] = np.ones(len(rests.last), dtype=bool)
        self._measured = self._directions()
        self.pointing: NDArray[np.bool_] = np.zeros(len(rests.last), dtype=bool)
        self.direction_sd = DIRECTION_SD
        self.place(self.x)
        self.before_m = self.frames.measured_m(self.poses(self.x))

    def _directions(self) -> Array:
        """Measured rotations (rests, 3, 3), NaN where there are none."""
        unknown = np.full((len(self.rests.last), 3, 3), np.nan)
        return unknown if self.rests.rotation is None else self.rests.rotation

    def _free_parameters(self, in_world: bool) -> NDArray[np.bool_]:
        free = np.ones(self._shape, dtype=bool)
        if np.linalg.norm(self.arm.gravity_m_s2) == 0.0:
            free[:, 4:6] = False
        if in_world:
            free[:, 12] = False  # the turn about the backbone is the base's
        return free.reshape(-1)

    def place(self, x: Array) -> None:
        """Lay the model's tips at ``x`` over the measured ones, where the frames are fitted."""
        if self.in_world:
            marker = self.frames_at(x).marker_m
            found = aligned(self.poses(x)[:, :3], self.rests.tip_m)
            self.frames = replace(found, marker_m=marker, axis=self.frames.axis)
            x[-9:] = 0.0

    def point(self, x: Array) -> None:
        """Compare directions too from here on; find where in the marker's frame the tip points."""
        self.pointing = np.asarray(np.isfinite(self._measured).all(axis=(1, 2)))
        if not self.pointing.any():
            return
        axes = self.axes(x)[self.pointing]
        axis = axes.mean(axis=0)
        axis /= np.linalg.norm(axis)
        turned = float(np.arccos(np.clip(axis[2], -1.0, 1.0)))
        if self.in_world or turned > _MARKER_TURNED:
            self.frames = replace(self.frames, axis=axis)
        angles = self.angles_rad(x)[self.pointing]
        left = float(np.sqrt(np.mean(angles**2)))
        self.direction_sd = min(max(DIRECTION_SD, left), LARGEST_DIRECTION_SD)

    def axes(self, x: Array) -> Array:
        """Directions (rests, 3) of the model's tips in the frame of the measured marker."""
        wanted = self.frames_at(x).directions(self.poses(x))
        axes: Array = np.einsum("kji,kj->ki", self._measured, wanted)
        return axes

    def theta(self, x: Array) -> Array:
        theta = self.start.reshape(-1).copy()
        theta[self._free] = x[: self.n_parameters]
        return theta.reshape(self._shape)

    def frames_at(self, x: Array) -> Frames:
        return self.frames.moved(x[-9:]) if self.in_world else self.frames

    def effective(self, x: Array) -> tuple[Array, Array]:
        """Pressures behind the hysteresis at the rests, and their derivative over the scaled w."""
        width = self.theta(x)[:, 13:] * self._span_pa
        outputs, slopes = play_outputs(self._history_pa, width)
        return outputs[self._at], slopes[self._at] * self._span_pa

    def poses(self, x: Array) -> Array:
        return self.model.poses(self.effective(x)[0], self.theta(x))

    def errors_m(self, x: Array) -> Array:
        """Distances (rests,) of the modelled tips from the measured ones."""
        away = self.frames_at(x).measured_m(self.poses(x)) - self.rests.tip_m
        with np.errstate(over="ignore"):  # a wild start has the tip infinitely far off
            distances: Array = np.linalg.norm(away, axis=1)
        return distances

    def angles_rad(self, x: Array) -> Array:
        """Angles (rests,) between the modelled and the measured directions, NaN for none."""
        cosine = self.axes(x) @ self.frames.axis
        return np.arccos(np.clip(cosine, -1.0, 1.0))

    def rows(self, x: Array) -> Array:
        pose, frames = self.poses(x), self.frames_at(x)
        errors = (frames.measured_m(pose) - self.rests.tip_m)[self.used] / MODEL_SD_M
        seen = self.used & self.pointing
        wanted = self._measured[seen] @ frames.axis
        turned = (frames.directions(pose[seen]) - wanted) / self.direction_sd
        data = np.concatenate([errors.reshape(-1), turned.reshape(-1)])
        return np.concatenate([_in_reach(data), (x - self.centre) / self.sd])

    def over_x(self, x: Array) -> Array:
        return np.concatenate([self.data_over_x(x), np.diag(1.0 / self.sd)])

    def data_over_x(self, x: Array) -> Array:
        """Derivative (rows of the data, len(x)) of the rows of the data."""
        pressures, slopes = self.effective(x)
        tips = self.model.tips(pressures, self.theta(x))
        batch, n = len(pressures), self.arm.n_sections
        whole = np.zeros((batch, 12, n, len(NAMES)))
        whole[..., :SHAPING] = tips.over_theta.reshape(batch, 12, n, SHAPING)
        by_chamber = tips.over_pressure.reshape(batch, 12, n, 3) * slopes[:, None]
        whole[..., 13] = by_chamber.sum(axis=-1)
        frames, free = self.frames_at(x), whole.reshape(batch, 12, -1)[..., self._free]
        seen = self.used & self.pointing
        positions = [frames.over_pose() @ free[self.used]]
        directions = [frames.directions_over_pose() @ free[seen]]
        if self.in_world:
            positions.append(frames.over_frames(tips.pose[self.used]))
            directions.append(frames.directions_over_frames(tips.pose[seen]))
        width = len(x)
        blocks = (
            np.concatenate(positions, axis=-1).reshape(-1, width) / MODEL_SD_M,
            np.concatenate(directions, axis=-1).reshape(-1, width) / self.direction_sd,
        )
        return _in_reach(np.concatenate(blocks))

    def spread(self, per_x: Array, missing: float) -> Array:
        """Values over the free parameters as (n_sections, len(NAMES))."""
        out = np.full(self._shape, missing).reshape(-1)
        out[self._free] = per_x[: self.n_parameters]
        return out.reshape(self._shape)

    def solved(self, x: Array, tolerance: float = 1e-10, tightness: float = 1.0) -> Array:
        """Least squares from ``x``; ``tightness`` is that of the priors."""
        inside = np.clip(x, self.lowest + 1e-9, self.highest - 1e-9)
        sd = self.sd
        self.sd = sd / tightness
        found = least_squares(
            self.rows,
            inside,
            self.over_x,
            bounds=(self.lowest, self.highest),
            xtol=tolerance,
            ftol=tolerance,
            gtol=tolerance,
            max_nfev=_EVALUATIONS,
        )
        self.sd = sd
        solution: Array = found.x
        return solution

    def solved_again(self, x: Array) -> Array:
        """Least squares from ``x``, and again around what ended on a bound of its meaning."""
        for _ in range(_TRIES):
            self.place(x)
            x = self.solved(self.solved(x, 1e-4, _TIGHT))
            bound = self.on_bound(x)
            if not bound.any():
                break
            self.centre[bound] = x[bound]
            self.lowest[bound] += x[bound] - self._middle[bound]
            self.highest[bound] += x[bound] - self._middle[bound]
            self._middle[bound] = x[bound]
        return x

    def on_bound(self, x: Array) -> NDArray[np.bool_]:
        """Which parameters (len(x),) ended on a bound; 0 is none to what may well be 0."""
        near = 1e-3
        low = (x - self.lowest < near) & (self.lowest != 0.0)
        hit: NDArray[np.bool_] = low | (self.highest - x < near)
        return hit

    def starts(self) -> list[Array]:
        """Other magnitudes of what scales the motion, the nearest to the rests first."""
        found: list[tuple[float, Array]] = []
        for lengthening, offset, compliance in product(_MAGNITUDES, _MAGNITUDES, _COMPLIANCES):
            theta = self.start.copy()
            theta[:, 1] += np.log(offset)
            theta[:, 2] += np.log(lengthening)
            theta[:, 4] = compliance
            x = self.x.copy()
            x[: self.n_parameters] = theta.reshape(-1)[self._free]
            self.place(x)
            found.append((float(self.errors_m(x).mean()), x))
        return [x for _, x in sorted(found, key=lambda each: each[0])[:_STARTS]]


def fit(arm: Arm, recording: Recording, rests: Rests, in_world: bool = False) -> Fit:
    """Fit the map of ``arm`` to the rests of a recording.

    ``in_world`` fits the frames of the measurement too: a position that is not that of the tip in
    the base, but of a marker in a frame of its own. Raises InvalidInput for a map that no arm
    can have.
    """
    problem = _Problem(arm, recording, rests, in_world)
    before = problem.x.copy()
    x = _best(problem)
    problem.point(x)
    x = problem.solved(x)
    return _fit_at(problem, before, x)


def _in_world_sd(arm: Arm, free: NDArray[np.bool_]) -> Array:
    """Priors where the frames are fitted: a base that may be anywhere takes a length's part."""
    sd = PRIOR_SD.copy()
    sd[[NAMES.index("rest_length"), NAMES.index("axial_compliance")]] = _LENGTHS_IN_WORLD_SD
    tiled: Array = np.tile(sd, arm.n_sections)[free]
    return tiled


def _in_reach(values: Array) -> Array:
    """Values with what is beyond any use cut off."""
    cut: Array = np.clip(np.nan_to_num(values), -_LARGEST, _LARGEST)
    return cut


def nearest(arm: Arm, recording: Recording, rests: Rests, in_world: bool) -> tuple[float, Frames]:
    """Mean distance (m) in which a fit to the positions leaves the rests, and its frames."""
    problem = _Problem(arm, recording, rests, in_world)
    x = _best(problem)
    return float(problem.errors_m(x).mean()), problem.frames_at(x)


def _best(problem: _Problem) -> Array:
    """The solution, over the positions, from the start that leads nearest to the rests."""
    x = problem.solved_again(problem.x.copy())
    best, best_m = x, float(problem.errors_m(x).mean())
    kept = problem.centre.copy(), problem.frames
    met_m = _MET_SHARE * problem.arm.total_rest_length_m
    for start in problem.starts() if best_m > met_m else []:
        x = problem.solved_again(start)
        left_m = float(problem.errors_m(x).mean())
        if left_m < 0.95 * best_m:
            best, best_m, kept = x, left_m, (problem.centre.copy(), problem.frames)
        if best_m < met_m:
            break
    problem.centre, problem.frames = kept
    return best


def _fit_at(problem: _Problem, before: Array, x: Array) -> Fit:
    data = problem.data_over_x(x)
    posterior = np.linalg.inv(data.T @ data + np.diag(problem.sd**-2.0))
    sd = np.sqrt(np.diag(posterior))
    theta, effective = problem.theta(x), problem.effective(x)[0]
    held_out_m, held_out_rad = _held_out(problem, x)
    return Fit(
        arm=arm_of(problem.arm, theta),
        frames=problem.frames_at(x),
        theta=theta,
        sd=problem.spread(sd, 0.0),
        share=problem.spread(sd / problem.sd, 1.0),
        pressures_pa=problem.pressures_pa,
        effective_pa=effective,
        measured_m=problem.rests.tip_m,
        before_m=problem.before_m,
        after_m=problem.frames_at(x).measured_m(problem.model.poses(effective, theta)),
        direction_before_rad=problem.angles_rad(before),
        direction_rad=problem.angles_rad(x),
        held_out_m=held_out_m,
        held_out_rad=held_out_rad,
        bound=problem.spread(problem.on_bound(x).astype(float), 0.0) > 0.0,
        in_world=problem.in_world,
    )


def _held_out(problem: _Problem, x: Array) -> tuple[Array, Array]:
    """Errors (rests,) in position and direction of fits that did not see the rest they judge.

    What lies in one stretch of time is left out together: it is nearly the same place.
    """
    stretch, rests = problem.rests.stretch, problem.rests
    number = np.arange(len(rests.last))
    if stretch is not None:
        number = np.unique(stretch, return_inverse=True)[1]
    errors_m, angles = np.full(len(number), np.nan), np.full(len(number), np.nan)
    for fold in range(_FOLDS):
        judged = number % _FOLDS == fold
        if not judged.any() or judged.all():
            continue
        problem.used = ~judged
        other = problem.solved(x, 1e-6)
        errors_m[judged] = problem.errors_m(other)[judged]
        angles[judged] = problem.angles_rad(other)[judged]
    problem.used = np.ones(len(number), dtype=bool)
    return errors_m, angles

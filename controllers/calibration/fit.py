"""Least squares: the parameters under which the model's tip is where the tip was measured.

Rows are the three coordinates of every rest, over ``MODEL_SD_M``, and one row a parameter that
keeps what the motion does not show near its nominal value. The Jacobian is exact.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.calibration.frames import Frames, aligned, in_base
from pneuarm.controllers.calibration.hysteresis import play_outputs
from pneuarm.controllers.calibration.model import TipModel
from pneuarm.controllers.calibration.parameters import (
    LOWEST,
    NAMES,
    PRIOR_SD,
    SHAPING,
    arm_of,
    span_pa,
    start_of,
)
from pneuarm.controllers.calibration.recording import Recording, Rests

#: What a measured rest may differ from the best model (m): creep, swing, a body that is no arc.
MODEL_SD_M = 1.5e-3

#: Prior of the frames: turn (rad) and places (m) are free, the marker (m) sits near the tip.
_FRAMES_SD = np.array([1.0] * 3 + [1.0] * 3 + [0.03] * 3)

#: A parameter whose standard deviation the data reduce to below this share of the prior is seen.
SEEN_SHARE = 0.5


@dataclass(frozen=True)
class Fit:
    """What least squares found. Tips (rests, 3) are in the measuring frame, m.

    ``theta`` and ``sd`` (n_sections, len(NAMES)) are scaled as in
    :mod:`pneuarm.controllers.calibration.parameters`; ``share`` is the sd over the prior's: what is
    near 1 was not seen in the data.
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
    #: Whether ``frames`` were fitted; else they are those of a tip measured in the base.
    in_world: bool


class _Problem:
    """The rows of one fit and their derivative, over ``x``: parameters, then frames if fitted."""

    def __init__(self, arm: Arm, recording: Recording, rests: Rests, in_world: bool) -> None:
        self.model, self.arm, self.rests = TipModel(arm), arm, rests
        self._sent_pa = recording.sent_pa
        self._span_pa = np.array([[span_pa(section)] for section in arm.sections])
        self.start = start_of(arm)
        self._shape = self.start.shape
        width = self.start[:, 13:] * self._span_pa
        acting, _ = play_outputs(recording.sent_pa, width)
        pose = self.model.poses(acting[rests.last], self.start)
        self.frames = aligned(pose[:, :3], rests.tip_m) if in_world else in_base()
        self.before_m = self.frames.measured_m(pose)
        self._free = self._free_parameters(in_world)
        self.in_world = in_world
        self.sd = np.tile(PRIOR_SD, arm.n_sections)[self._free]
        self.lowest = np.tile(LOWEST, arm.n_sections)[self._free]
        self.x = self.start.reshape(-1)[self._free]
        if in_world:
            self.sd = np.append(self.sd, _FRAMES_SD)
            self.lowest = np.append(self.lowest, np.full(9, -np.inf))
            self.x = np.append(self.x, np.zeros(9))
        self._centre = self.x.copy()

    def _free_parameters(self, in_world: bool) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
        free = np.ones(self._shape, dtype=bool)
        if np.linalg.norm(self.arm.gravity_m_s2) == 0.0:
            free[:, 4:6] = False
        if in_world:
            free[:, 12] = False  # the turn about the backbone is the base's
        return free.reshape(-1)

    def theta(self, x: Array) -> Array:
        theta = self.start.reshape(-1).copy()
        theta[self._free] = x[: self._free.sum()]
        return theta.reshape(self._shape)

    def frames_at(self, x: Array) -> Frames:
        return self.frames.moved(x[-9:]) if self.in_world else self.frames

    def effective(self, x: Array) -> tuple[Array, Array]:
        """Pressures behind the hysteresis at the rests, and their derivative over the scaled w."""
        width = self.theta(x)[:, 13:] * self._span_pa
        outputs, slopes = play_outputs(self._sent_pa, width)
        last = self.rests.last
        return outputs[last], slopes[last] * self._span_pa

    def rows(self, x: Array) -> Array:
        pressures, _ = self.effective(x)
        pose = self.model.poses(pressures, self.theta(x))
        errors = (self.frames_at(x).measured_m(pose) - self.rests.tip_m) / MODEL_SD_M
        return np.append(errors.reshape(-1), (x - self._centre) / self.sd)

    def over_x(self, x: Array) -> Array:
        return np.concatenate([self.data_over_x(x), np.diag(1.0 / self.sd)])

    def data_over_x(self, x: Array) -> Array:
        """Derivative (3 rests, len(x)) of the rows of the data."""
        pressures, slopes = self.effective(x)
        tips = self.model.tips(pressures, self.theta(x))
        batch, n = len(pressures), self.arm.n_sections
        whole = np.zeros((batch, 12, n, len(NAMES)))
        whole[..., :SHAPING] = tips.over_theta.reshape(batch, 12, n, SHAPING)
        by_chamber = tips.over_pressure.reshape(batch, 12, n, 3) * slopes[:, None]
        whole[..., 13] = by_chamber.sum(axis=-1)
        frames = self.frames_at(x)
        free = whole.reshape(batch, 12, -1)[..., self._free]
        blocks = [frames.over_pose() @ free]
        if self.in_world:
            blocks.append(frames.over_frames(tips.pose))
        return np.concatenate(blocks, axis=-1).reshape(3 * batch, -1) / MODEL_SD_M

    def spread(self, per_x: Array, missing: float) -> Array:
        """Values over the free parameters as (n_sections, len(NAMES))."""
        out = np.full(self._shape, missing).reshape(-1)
        out[self._free] = per_x[: self._free.sum()]
        return out.reshape(self._shape)


def fit(arm: Arm, recording: Recording, rests: Rests, in_world: bool = False) -> Fit:
    """Fit the map of ``arm`` to the rests of a recording.

    ``in_world`` fits the frames of the measurement too: a position that is not that of the tip in
    the base, but of a marker in a frame of its own.
    """
    problem = _Problem(arm, recording, rests, in_world)
    found = least_squares(
        problem.rows,
        np.maximum(problem.x, problem.lowest + 1e-9),
        problem.over_x,
        bounds=(problem.lowest, np.inf),
        xtol=1e-10,
        ftol=1e-10,
        gtol=1e-10,
    )
    x = found.x
    data = problem.data_over_x(x)
    posterior = np.linalg.inv(data.T @ data + np.diag(problem.sd**-2.0))
    sd = np.sqrt(np.diag(posterior))
    theta, effective = problem.theta(x), problem.effective(x)[0]
    after_m = problem.frames_at(x).measured_m(problem.model.poses(effective, theta))
    return Fit(
        arm=arm_of(arm, theta),
        frames=problem.frames_at(x),
        theta=theta,
        sd=problem.spread(sd, 0.0),
        share=problem.spread(sd / problem.sd, 1.0),
        pressures_pa=recording.sent_pa[rests.last],
        effective_pa=effective,
        measured_m=rests.tip_m,
        before_m=problem.before_m,
        after_m=after_m,
        in_world=in_world,
    )

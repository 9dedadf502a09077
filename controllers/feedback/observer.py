"""Disturbance observer: by how much the tip is elsewhere than the model has it.

Internal-model control (Garcia and Morari, 1982): the commanded lengths go through a model of the
arm's response, and what a measured tip pose differs from the predicted one *of the time at which it
was taken* is the disturbance: droop, hysteresis, creep, wrong coefficients. Filtered, it is the
correction with which the laws see the tip. The prediction is of what was really commanded, so
nothing winds up where the arm cannot follow.

A sensor may lie, so it moves the command by a bounded amount only: the correction has a largest
size, and a tip that does not go along with the model's is not followed at all. A model may be wrong
by more than a correction bears: where the tip swings around where it is to be, the correction gets
the period of the swing as its time constant. Where the phase of what is corrected makes it swing at
a frequency omega, it then crosses unity gain at omega / 2 pi, where that phase is far from it.
"""

import math
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.feedback.goes_along import GoesAlong
from pneuarm.controllers.feedback.prediction import Prediction
from pneuarm.controllers.feedback.swing_watch import SwingWatch
from pneuarm.controllers.geometry.moving_point import MovingPoint
from pneuarm.controllers.geometry.rotations import (
    quaternion_from_rotation,
    rotation_from_vector,
    rotation_vector,
)

#: Time constant (s) by which the estimate follows the measured difference, and its scatter.
_FAST_S, _SCATTER_S = 0.02, 0.5

#: A tip whose mean of 30 ms is nearer (m) than this to that of 200 ms stands still. A chamber that
#: sticks must be pushed through its dead band; an arm that swings must not be pushed at its swing.
_QUICK_S, _SLOW_S, _STILL_M = 0.03, 0.2, 2e-4

#: The correction of a tip that stands still goes so many times faster.
_WHEN_STILL = 2.0

#: A correction that was at its largest no longer is below this share of it.
_BACK_SHARE = 0.9

#: The integral correction of what answers after an effective dead time theta has the time constant
#: 2 theta at least (Skogestad, Simple analytic rules for model reduction and PID controller tuning,
#: J. Process Control 13, 2003: tau_c = theta, K_I = 1 / (tau_c + theta) where there is no lag).
_DEAD_TIMES = 2.0

#: A correction that would have to be slower (s) than this stays as it is.
SLOWEST_S = 10.0

#: An estimate is never told to be better than this (m): no camera sees an arm more exactly.
_LEAST_SIGMA_M = 5e-5


@dataclass(frozen=True)
class FeedbackSettings:
    """How the correction follows the measured tip, and when a measurement is believed.

    ``delay_s`` is the age of a pose when it arrives; after ``timeout_s`` without one the camera
    counts as lost. A pose that is more than ``jump_max_m`` off the ones before is refused until
    such poses have agreed with each other for ``jump_accept_s``. The correction is at most
    ``offset_max_share`` of the arm's length and ``turn_max_rad``. Where the model's tip moves by
    ``still_max_m`` and the measured one does not, no pose is believed until it does.
    """

    enabled: bool = True
    delay_s: float = 0.01
    timeout_s: float = 0.1
    time_constant_s: float = 0.17
    rate_max_m_s: float = 0.05
    deadband_m: float = 1e-4
    jump_max_m: float = 0.02
    jump_accept_s: float = 0.5
    offset_max_share: float = 0.25
    turn_max_rad: float = 0.25 * math.pi
    still_max_m: float = 0.01
    model_sigma_m: float = 0.025
    length_sigma_m: float = 0.01
    dither_pa: float = 1500.0
    dither_period_s: float = 0.03
    hysteresis_share: float = 0.55
    hysteresis_share_moving: float = 0.65


class Verdict(Enum):
    """What became of a measured pose."""

    TAKEN = auto()
    REFUSED = auto()
    ACCEPTED_ANEW = auto()
    NOT_ALONG = auto()
    LATE = auto()
    #: It was taken, and the tip is found to swing.
    SWINGS = auto()


class TipObserver:
    """The correction, from measured tip poses of known age.

    ``offset_m`` (3,) and ``rotation`` (3, 3) are what :meth:`Controller.set_correction` takes. They
    are replaced, never written into. A tip that goes to and fro by less than ``still_m`` stands.
    """

    def __init__(
        self, arm: Arm, settings: FeedbackSettings, period_s: float, still_m: float
    ) -> None:
        self._settings, self._period_s = settings, period_s
        self.swing = SwingWatch(still_m)
        self._turned_down_s = 0.0
        #: What comes between a correction and the pose that shows it, but for the camera's pause.
        self._loop_s = arm.response.delay_s + arm.response.slower_lag_s + settings.delay_s
        self._pause_s = 0.0
        self._delay_s = arm.response.delay_s
        self.prediction = Prediction(arm, period_s)
        self.offset_m, self.rotation = np.zeros(3), np.eye(3)
        self.quaternion_xyzw = quaternion_from_rotation(self.rotation)
        self.seen = False
        #: Whether the measured tip asks for a larger correction than is allowed.
        self.limited = False
        self.refused = 0
        self.offset_max_m = settings.offset_max_share * float(arm.rest_lengths_m.mean(axis=1).sum())
        self._along = GoesAlong(settings.still_max_m)
        #: Differences (3,) when the tip last went along with the model's, and the time before.
        self._trusted, self._trusted_before = self.offset_m, self.offset_m
        self._returns = self._turn_limited = False
        self._beyond_m = 0.0
        self._turn = np.zeros(3)
        self._residual, self._fast = np.zeros(3), np.zeros(3)
        self._wanted = self._fast
        self._variance_m2 = settings.model_sigma_m**2
        self._quick, self._slow = np.zeros(3), np.zeros(3)
        self._since_pose_s = math.inf
        self._since_taken_s = math.inf
        self._candidate: Array | None = None
        self._candidate_s = 0.0

    def forget_swings(self) -> None:
        """Let the correction be as fast again as it was before any swing."""
        self._turned_down_s = 0.0

    @property
    def time_constant_s(self) -> float:
        """How fast the correction follows; infinite where it stays as it is."""
        steady_s = _DEAD_TIMES * (self._loop_s + self._pause_s)
        return max(self._settings.time_constant_s, steady_s, self._turned_down_s)

    def measure(
        self, position_m: Array, rotation: Array, waited_s: float, wanted: MovingPoint | None = None
    ) -> Verdict:
        """Take a pose that arrived so long before this tick, and where it is to be, where known."""
        if waited_s > self._settings.timeout_s:
            self.refused += 1
            return Verdict.LATE
        age_s = self._settings.delay_s + waited_s + self._delay_s
        predicted, turned = self.prediction.ago(age_s)
        residual, pause_s = position_m - predicted, min(self._since_pose_s, 1.0)
        tips = (position_m, predicted, predicted + self.offset_m)
        if not self._along.believed and not self._along.look(*tips, pause_s):
            self._since_pose_s = 0.0
            self.refused += 1
            return Verdict.NOT_ALONG
        verdict = self._judge(residual)
        if verdict is Verdict.REFUSED:
            self.refused += 1
            return verdict
        if not self._along.look(*tips, pause_s):
            self._give_back()
            self.refused += 1
            return Verdict.NOT_ALONG
        self._take(residual, position_m, verdict is Verdict.TAKEN and self.seen)
        if self._along.agreed:
            self._trusted_before = self._trusted
        if self._along.agreed or self._along.near:
            self._trusted = self._fast
        if self._along.stands:
            self._trusted_before = self._trusted
        self._follow_turn(rotation_vector(rotation @ turned.T), pause_s)
        if wanted is None or math.isinf(self.time_constant_s):
            self.swing.begin_anew()
            return verdict
        if not self.swing.look(position_m, wanted, pause_s):
            return verdict
        slower_s = max(2.0 * self.time_constant_s, self.swing.period_s)
        self._turned_down_s = slower_s if slower_s <= SLOWEST_S else math.inf
        return Verdict.SWINGS

    def _give_back(self) -> None:
        """Go back to the difference before the tip ceased to go along: what came since is wrong."""
        self._fast = self._residual = self._trusted_before
        self._returns = True

    def _judge(self, residual: Array) -> Verdict:
        """Whether a difference goes with the ones before, or has lasted long enough."""
        settings, pause_s = self._settings, self._since_pose_s
        self._since_pose_s = 0.0
        never = math.isinf(self._since_taken_s)
        largest = 3.0 * settings.model_sigma_m if never else settings.jump_max_m
        if not never and pause_s > settings.timeout_s:  # what was not seen may have wandered
            largest += settings.rate_max_m_s * pause_s
        if _norm(residual - self._residual) <= largest:
            self._candidate = None
            return Verdict.TAKEN
        agrees = (
            self._candidate is not None
            and pause_s <= settings.timeout_s
            and _norm(residual - self._candidate) <= settings.jump_max_m
        )
        self._candidate_s = self._candidate_s + pause_s if agrees else 0.0
        self._candidate = residual
        # A tip that is said to have gone further than may be corrected is not where it is said.
        beyond = _norm(residual) > self.offset_max_m and not never
        if self._candidate_s < settings.jump_accept_s or beyond:
            return Verdict.REFUSED
        self._candidate = None
        return Verdict.ACCEPTED_ANEW

    def _take(self, residual: Array, position_m: Array, continued: bool) -> None:
        self._pause_s = pause_s = min(self._since_taken_s, 1.0)
        self._residual = residual
        if continued:
            change = residual - self._fast
            share = 1.0 - math.exp(-pause_s / _FAST_S)
            self._fast = self._fast + share * change
            self._quick = self._quick + min(1.0, pause_s / _QUICK_S) * (position_m - self._quick)
            share = 1.0 - math.exp(-pause_s / _SLOW_S)
            self._slow = self._slow + share * (position_m - self._slow)
            rest = math.exp(-pause_s / _SCATTER_S)
            self._variance_m2 += (1.0 - rest) * (float(change @ change) - self._variance_m2)
        else:
            self._fast, self._quick, self._slow = residual, position_m, position_m
            self._variance_m2 = (0.1 * self._settings.model_sigma_m) ** 2
        self._since_taken_s, self.seen, self._returns = 0.0, True, False

    def _follow_turn(self, turn: Array, pause_s: float) -> None:
        """Follow a measured turn (3,) after a pause; one larger than allowed changes nothing."""
        self._turn_limited = _norm(turn) > self._settings.turn_max_rad
        if self._turn_limited:
            return
        share = min(1.0, pause_s / self.time_constant_s)
        self._turn = self._turn + share * (turn - self._turn)
        self.rotation = rotation_from_vector(self._turn)
        self.quaternion_xyzw = quaternion_from_rotation(self.rotation)

    def step(self, lengths_m: Array) -> None:
        """Go on by one tick under commanded lengths (n_sections, 3).

        ``seen`` turns False when the camera is lost; the correction then stays as it is.
        """
        self.prediction.step(lengths_m)
        self._since_pose_s += self._period_s
        self._since_taken_s += self._period_s
        if self._since_taken_s > self._settings.timeout_s:
            self.seen = False
        self._bound()
        if not self._settings.enabled or not (self.seen or self._returns):
            return
        difference = self._wanted - self.offset_m
        size = _norm(difference)
        if size > self._settings.deadband_m:
            share = self._period_s / self.time_constant_s
            if _norm(self._quick - self._slow) < _STILL_M:
                share *= _WHEN_STILL
            share = min(share, self._settings.rate_max_m_s * self._period_s / size)
            self.offset_m = self.offset_m + share * difference

    def _bound(self) -> None:
        """Find the correction that is wanted and allowed; there is a way back before it is told."""
        size, most = _norm(self._fast), self.offset_max_m
        self._wanted = self._fast if size <= most else self._fast * (most / size)
        self._beyond_m = max(0.0, size - most)
        again = size > (_BACK_SHARE if self.limited else 1.0) * most
        self.limited = self.seen and (again or self._turn_limited)

    def estimate(self) -> tuple[Array, Array]:
        """Where the tip is now, position (3,) and rotation (3, 3).

        From the prediction and the newest differences; call it after :meth:`step`.
        """
        position, rotation = self.prediction.ago(self._delay_s + self._period_s)
        return position + self._fast, self.rotation @ rotation

    @property
    def length_sigma_m(self) -> float:
        """Standard deviation of the tip where sensors measure the lengths."""
        return self._settings.length_sigma_m

    @property
    def sigma_m(self) -> float:
        """Standard deviation of the estimate: the scatter of the differences, growing when lost."""
        settings = self._settings
        if math.isinf(self._since_taken_s):
            return settings.model_sigma_m
        lost = 0.0 if self.seen else min(1.0, self._since_taken_s / 30.0) * settings.model_sigma_m
        variance_m2 = max(self._variance_m2, _LEAST_SIGMA_M**2)
        return math.sqrt(variance_m2 + lost**2 + self._beyond_m**2)


def _norm(vector: Array) -> float:
    return math.sqrt(vector @ vector)

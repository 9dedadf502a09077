"""Trial after trial: what is sent next, what is kept, and when there is no use in going on."""

from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import LearningDiverges
from pneuarm.controllers.learning.course import STEP_S, Course
from pneuarm.controllers.learning.law import GAIN, Law, cutoff_hz, find_advance_s

#: A trial whose error is so many times the best one's is undone.
_WORSE = 1.5

#: So many such trials, one after the other, are a learning that diverges.
_PATIENCE = 2


@dataclass(frozen=True, eq=False)  # two trials are never the same one
class Trial:
    """One run of the course: the offsets (n, 3) that it was sent with, and its error (n, 3)."""

    offset_m: Array
    error_m: Array
    rms_m: float
    max_m: float


class Learning:
    """The trials of a course, and the offsets ``offset_m`` (n, 3) of the next one.

    The first is sent as it is wanted, and shows by how much the tip is late. ``offset_max_m``
    bounds what is learnt, ``mode_hz`` is the arm's lowest mode.
    """

    def __init__(self, course: Course, offset_max_m: float, mode_hz: float) -> None:
        self.course = course
        self._offset_max_m, self._mode_hz = offset_max_m, mode_hz
        self._gain, self._failed = GAIN, 0
        self.law: Law | None = None
        self.offset_m = np.zeros_like(course.wanted_m)
        self.trials: list[Trial] = []

    @property
    def best(self) -> Trial:
        """The trial with the smallest error: what is kept."""
        return min(self.trials, key=lambda trial: trial.rms_m)

    @property
    def has_learnt(self) -> bool:
        """Whether a trial was better than the first, in which nothing was known."""
        return bool(self.trials) and self.best is not self.trials[0]

    def is_worse(self, trial: Trial) -> bool:
        """Whether a trial is so much worse than the best one that it is undone."""
        return trial.rms_m > _WORSE * self.best.rms_m

    def take(self, tip_m: Array) -> Trial:
        """Learn from the measured tip (n, 3) of the trial with the present offsets.

        Raises LearningDiverges after two trials, one after the other, that were much worse than the
        best; LearningError where the tip of the first did not follow at all.
        """
        trial = self._judged(tip_m)
        if self.law is None:
            self.law = self._law(tip_m)
        self.trials.append(trial)
        worse = self.is_worse(trial)
        self._failed = self._failed + 1 if worse else 0
        if self._failed == _PATIENCE:
            raise LearningDiverges(_diverges(trial, self.best))
        if worse:
            self._gain /= 2.0
        start = self.best if worse else trial
        self.offset_m = self.law.improved(start.offset_m, start.error_m, self._gain)
        return trial

    def refuse(self) -> bool:
        """Take half of the last step from the best, where the arm does not take these offsets.

        Return whether to go on: not when it was the second refusal, one after the other.
        """
        if self.law is None:
            return False
        self._failed += 1
        self._gain /= 2.0
        self.offset_m = self.law.improved(self.best.offset_m, self.best.error_m, self._gain)
        return self._failed < _PATIENCE

    def _judged(self, tip_m: Array) -> Trial:
        error_m = self.course.wanted_m - tip_m
        distance_m = np.linalg.norm(error_m[self.course.judged], axis=1)
        rms_m = float(np.sqrt((distance_m**2).mean()))
        return Trial(self.offset_m, error_m, rms_m, float(distance_m.max()))

    def _law(self, tip_m: Array) -> Law:
        course = self.course
        advance_s = find_advance_s(course.wanted_m + self.offset_m, tip_m, STEP_S)
        cutoff = cutoff_hz(advance_s, self._mode_hz, course.waypoint_step_s)
        return Law(advance_s, cutoff, self._offset_max_m, STEP_S)


def _diverges(trial: Trial, best: Trial) -> str:
    return (
        f"the error grows from trial to trial (RMS {1e3 * trial.rms_m:.1f} mm, "
        f"{1e3 * best.rms_m:.1f} mm at its best), also at half the gain: the arm does not answer "
        "twice alike, or not as arm.response says, so the learning was ended; calibrate the arm, "
        "or give the trajectory more time, and learn again"
    )

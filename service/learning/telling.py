"""What the operator sees of a learning: which trial, how near, and how long it still takes."""

import sys

from pneuarm.controllers.learning.learning import Learning, Trial

#: Characters of the line that is written over on a terminal.
_WIDTH = 60


def error_text(trial: Trial) -> str:
    """Error of a trial, in words."""
    return f"RMS {1e3 * trial.rms_m:.2f} mm, at most {1e3 * trial.max_m:.2f} mm"


def say(text: str) -> None:
    """Print a sentence for the operator, over the line of the present trial if there is one."""
    start = "\r" if sys.stderr.isatty() else ""
    print(f"{start}{text:{_WIDTH}}".rstrip(" "), file=sys.stderr, flush=True)


class Telling:
    """A line a trial on stderr; on a terminal the time that is left too."""

    def __init__(self, learning: Learning, trials: int, trial_s: float) -> None:
        self._learning, self._trials, self._trial_s = learning, trials, trial_s
        self._shown = -1

    def begins(self, arm: str, trajectory: str) -> None:
        """Tell what the arm is about to do, and how to end it."""
        say(
            f"arm {arm} follows {trajectory} {self._trials} times, for {self._left_s():.0f} s; "
            "keep its workspace free; Ctrl-C ends it with the arm holding"
        )

    def elapsed(self, seconds: float) -> None:
        """Tell that the present trial has gone on for some time (s)."""
        left = round(self._left_s() - min(seconds, self._trial_s))
        if sys.stderr.isatty() and left != self._shown:
            self._shown = left
            text = f"trial {len(self._learning.trials) + 1} of {self._trials} ..., {left} s left"
            print(f"\r{text:{_WIDTH}}", end="", file=sys.stderr, flush=True)

    def trial(self, trial: Trial) -> None:
        """Tell of a trial that is over."""
        number = len(self._learning.trials)
        worse = self._learning.is_worse(trial)
        undone = f" (worse than trial {self._best}: undone)" if worse else ""
        say(
            f"trial {number} of {self._trials}: {error_text(trial)}{undone}; "
            f"{self._left_s():.0f} s left"
        )

    def again(self, why: str) -> None:
        """Tell why the present trial is gone through once more."""
        say(f"trial {len(self._learning.trials) + 1} of {self._trials} again: {why}")

    def breaks_off(self) -> None:
        """Leave the line of the present trial as it is: what comes next has a line of its own."""
        if sys.stderr.isatty() and self._shown >= 0:
            print(file=sys.stderr, flush=True)

    @property
    def _best(self) -> int:
        return self._learning.trials.index(self._learning.best) + 1

    def _left_s(self) -> float:
        return (self._trials - len(self._learning.trials)) * self._trial_s

"""The trials, one after the other: follow, learn, tell."""

from collections.abc import Callable

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import TargetRejected, TrialLost
from pneuarm.controllers.learning.learning import Learning, Trial
from pneuarm.controllers.targets.trajectory import TrajectoryTarget

#: Follows a trajectory from its beginning at rest; returns the measured tip on the course's grid.
Follow = Callable[[TrajectoryTarget], Array]

#: A trial that shows nothing is gone through again, but not for ever.
_AGAIN = 3

_IDS = 2**16


def learn(
    learning: Learning,
    trials: int,
    follow: Follow,
    tell: Callable[[Trial], None] = lambda trial: None,
    first_id: int = 0,
    again: Callable[[str], None] = lambda why: None,
) -> str:
    """Repeat the course of ``learning``; return why it ended early, or nothing.

    ``tell`` hears of every trial, also of the one at which the learning is found to diverge, and
    ``again`` why one is gone through once more. What is learnt ends where the arm can do no more:
    at trajectories that the daemon refuses. That the wanted one is refused is raised,
    TargetRejected, as is all else that happens on the way; TrialLost only when it comes ``_AGAIN``
    times, one after the other.
    """
    shape_id, lost, refused = first_id, 0, 0
    while len(learning.trials) + refused < trials:
        target, shape_id = learning.course.shifted(learning.offset_m, shape_id), shape_id + 1
        shape_id %= _IDS
        try:
            tip_m = follow(target)
        except TrialLost as error:
            lost += 1
            if lost == _AGAIN:
                raise
            again(str(error))
            continue
        except TargetRejected as error:
            refused += 1
            if not learning.trials:
                raise
            if learning.refuse():
                again(f"the daemon refuses what was learnt, half the step is tried: {error}")
                continue
            return f"more cannot be learnt: with it the daemon refuses the trajectory: {error}"
        lost, known = 0, len(learning.trials)
        try:
            learning.take(tip_m)
        finally:
            for trial in learning.trials[known:]:
                tell(trial)
    return ""

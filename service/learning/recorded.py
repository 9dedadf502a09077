"""Ticks, live or of a simulated loop, as the measured tip of one trial."""

import numpy as np

from pneuarm.controllers.actuation.valve_lead import ValveLead
from pneuarm.controllers.arm.arm import Array, Response
from pneuarm.controllers.arm.errors import TrialLost
from pneuarm.controllers.learning.course import Course
from pneuarm.controllers.reference.follower import lead_of
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.configuration import Configuration

#: Poses that were taken closer together (s) than this are one.
_AGAIN_S = 1e-3


def measured_tip(ticks: np.ndarray, course: Course, configuration: Configuration) -> Array:
    """Tip (n, 3) on the course's grid, of ticks (see :mod:`pneuarm.logs.rings.tick`) of one trial.

    A pose counts for the time at which the camera took it: before its receipt by the camera's
    delay. The course begins when its trajectory first arrived, and is to be gone through by the tip
    later by what the reference runs ahead. Raises TrialLost where it was not seen all the way.
    """
    begin_ns = _begin_ns(ticks)
    late_s = ahead_s(configuration.build_arm().response) + configuration.feedback.settings().delay_s
    age_s = np.nan_to_num(ticks["tip_measured_age_s"])
    taken_s = (ticks["time_unix_ns"] - begin_ns) * 1e-9 - age_s - late_s
    tips = ticks["tip_measured_position_m"]
    newest = np.maximum.accumulate(np.concatenate([[-np.inf], taken_s[:-1]]))
    fresh = np.isfinite(tips).all(axis=1) & (taken_s > newest + _AGAIN_S)
    return course.on_grid(taken_s[fresh], tips[fresh])


def _begin_ns(ticks: np.ndarray) -> int:
    """Time at which the trajectory first arrived."""
    followed = np.flatnonzero(ticks["target_kind"] == pb.TRAJECTORY)
    if not len(followed):
        raise TrialLost("the arm did not follow the trajectory, so nothing was learnt from it")
    first = ticks[followed[0]]
    return int(first["time_unix_ns"]) - round(1e9 * float(first["target_age_s"]))


def ahead_s(response: Response) -> float:
    """By how much (s) the reference runs ahead of the tip."""
    return lead_of(ValveLead(response).behind).ahead_s

"""One trial on a running daemon: to the beginning, wait, and along the trajectory."""

import time
from collections.abc import Callable

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import LearningError, ModeRefused, TrialLost
from pneuarm.controllers.learning.course import Course
from pneuarm.controllers.limits.limits import words
from pneuarm.controllers.targets.trajectory import TrajectoryTarget
from pneuarm.logs.rings.tick import ticks_from_states
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.calibration.drive import is_measured, left_active, not_measured
from pneuarm.service.client.client import Client
from pneuarm.service.client.target_messages import position_target, trajectory_target
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.learning.recorded import measured_tip

#: The way to the beginning, and the rest there (s): every trial begins alike. An arm that is not
#: there by then gets as long again, so many times at most.
APPROACH_S = 3.0
_APPROACHES = 5

#: The states of the end arrive a little later (s).
_BEYOND_S = 0.3

_REFRESH_S = 0.04
_POLL_S = 0.002


def trial_s(course: Course) -> float:
    """How long a trial takes."""
    return APPROACH_S + course.duration_s + _BEYOND_S


class Driver:
    """Follows trajectories as a client; the arm is active, and its lease this client's.

    ``tell`` hears how long (s) the trial has taken, ``warn`` what the arm cannot do. Raises
    TargetRejected, ModeRefused where the arm stops following, TrialLost after a stall, and
    LearningError where the tip is no longer measured.
    """

    def __init__(
        self,
        client: Client,
        course: Course,
        configuration: Configuration,
        tell: Callable[[float], None],
        warn: Callable[[str], None],
    ) -> None:
        self._client, self._course, self._configuration = client, course, configuration
        self._tell, self._warn = tell, warn
        self._limits = 0
        self._waits_s = 0.5e-3 * configuration.control.target_timeout_ms

    def follow(self, target: TrajectoryTarget) -> Array:
        """Go through one trial; return the measured tip on the course's grid."""
        beginning = position_target(target.positions_m[0])
        for _ in range(_APPROACHES):
            if self._send(beginning, APPROACH_S, 0.0)[-1].reach != pb.MOVING:
                break
        waypoints = zip(target.times_s, target.positions_m, strict=True)
        message = trajectory_target(waypoints, target.id)
        states = self._send(message, self._course.duration_s + _BEYOND_S, APPROACH_S)
        self._warn_of_limits(states)
        ticks = ticks_from_states(states, states[0].n_sections)
        return measured_tip(ticks, self._course, self._configuration)

    def _send(self, message: pb.Target, seconds: float, done_s: float) -> list[pb.ArmState]:
        """Have a target followed for some time; return the states, the first one of it first."""
        client = self._client
        client.events()
        states = [self._begin(message)]
        began_s = sent_s = time.monotonic()
        while (now_s := time.monotonic()) - began_s < seconds:
            if now_s - sent_s >= _REFRESH_S:
                # A target that is refused goes stale, and the arm holds: its event says why.
                client.send(message)
                sent_s = now_s
            state = client.state()
            if state.sequence != states[-1].sequence:
                self._require_going_on(state)
                states.append(state)
            self._tell(done_s + now_s - began_s)
            time.sleep(_POLL_S)
        return states

    def _begin(self, message: pb.Target) -> pb.ArmState:
        """Send a target once; return the first state of it, whose age says when it arrived."""
        client = self._client
        first, until_s = client.send(message), time.monotonic() + self._waits_s
        while time.monotonic() < until_s:
            state = client.state()
            if state.mode != pb.ACTIVE:
                self._require_going_on(state)
            if state.target_sequence >= first:
                return state
            client.raise_if_refused(first)
            time.sleep(_POLL_S)
        raise TrialLost(
            f"a target was not taken within {1e3 * self._waits_s:.0f} ms, so this trial shows "
            "nothing: the network or the machine stalled; end what keeps it busy, and learn again"
        )

    def _warn_of_limits(self, states: list[pb.ArmState]) -> None:
        """Say which limits kept the arm from its trajectory, each once."""
        out = [state for state in states if state.reach == pb.OUT_OF_REACH]
        limits = self._limits
        for state in out:
            limits |= state.binding_limits
        if limits != self._limits:
            self._limits = limits
            self._warn(
                f"part of the trajectory is out of reach ({words(limits)} binds): what is missing "
                "there cannot be learnt"
            )

    def _require_going_on(self, state: pb.ArmState) -> None:
        if state.mode != pb.ACTIVE:
            why = left_active(self._client, state, "a trial")
            raise ModeRefused(f"{why}; look for the cause, and learn again")
        if not is_measured(state):
            raise LearningError(not_measured(self._client.arm, "learning"))


def require_tip(client: Client) -> None:
    """Raise LearningError where no tip pose arrives at the daemon."""
    if not is_measured(client.state()):
        raise LearningError(not_measured(client.arm, "learning"))


def bound_m(configuration: Configuration) -> float:
    """Largest offset (m) that may be learnt, or followed."""
    length_m = float(np.sum(configuration.build_arm().rest_lengths_m.mean(axis=1)))
    return configuration.feedback.learned_max_share * length_m

"""The smooth reference between targets: a point that goes to a goal within its limits.

Time-optimal in each axis by Ruckig (Berscheid and Kroeger, "Jerk-limited real-time trajectory
generation with arbitrary target states", 2021). A new goal makes one plan, which meets the goal
where it will be; from then on the reference is the goal, so a goal that keeps the limits itself
is followed exactly. Goals of a stream come too often to be planned for: a point that is near such
a goal is drawn to it, which is smooth where plan after plan would not be.
"""

from collections.abc import Callable
from dataclasses import dataclass

from ruckig import InputParameter, Ruckig, RuckigError, Synchronization, Trajectory

from pneuarm.controllers.geometry.moving_point import MovingPoint

#: What a goal may ask of the limits: at the limits themselves rounding makes Ruckig refuse.
FASTEST_SHARE = 0.98

#: A moving goal is met this much later than time-optimally, so that there is a time to agree on.
_SLACK = 1.02

#: How stiffly (1/s) a point is drawn to the goals of a stream at most, and at least: where that
#: would ask too much of the limits it is far away, and a plan takes it there.
_PULL_MAX_PER_S, _PULL_MIN_PER_S = 40.0, 15.0

#: A point that is drawn is let go below this (1/s), and gets stiffer by no more than this a goal.
_PULL_KEPT_PER_S, _STIFFER = 7.0, 1.05

#: Tries to agree on the time, and what counts as agreed (s).
_TRIES = 12
_AGREED_S = 1e-9

#: Below this (m or rad, and that a second and a second squared) a goal is met: with less than
#: nanometres between them, and of a speed to go with, Ruckig sometimes finds no way.
_MET = 1e-6


@dataclass(frozen=True)
class ReferenceLimits:
    """How fast (m/s), how hard (m/s^2) and how suddenly (m/s^3) the reference may move."""

    speed_m_s: float = 0.5
    acceleration_m_s2: float = 2.0
    jerk_m_s3: float = 20.0


#: Where a goal is so many seconds from now.
Goal = Callable[[float], MovingPoint]


class Reference:
    """A point (n,) with velocity and acceleration; n is 3, or 6 with a rotation vector.

    The limits hold for the norm of the first three coordinates, and of the last three with the
    limits of the turn: an axis gets 1/sqrt(3) of them, so no direction exceeds them.
    """

    def __init__(self, limits: ReferenceLimits, turn: ReferenceLimits | None = None) -> None:
        axes = [limits] * 3 + ([] if turn is None else [turn] * 3)
        self.size, share = len(axes), 3.0**-0.5
        self._speed = [FASTEST_SHARE * share * axis.speed_m_s for axis in axes]
        self._acceleration = [FASTEST_SHARE * share * axis.acceleration_m_s2 for axis in axes]
        self._otg, self._input = Ruckig(self.size), InputParameter(self.size)
        self._speed_max = [share * axis.speed_m_s for axis in axes]
        self._input.max_velocity = self._speed_max
        self._acceleration_max = [share * axis.acceleration_m_s2 for axis in axes]
        self._input.max_acceleration = self._acceleration_max
        self._jerk_max = [share * axis.jerk_m_s3 for axis in axes]
        self._input.max_jerk = self._jerk_max
        self._input.synchronization = Synchronization.Phase
        self.error = ""
        self.start([0.0] * self.size)

    def start(
        self,
        position: list[float],
        velocity: list[float] | None = None,
        acceleration: list[float] | None = None,
    ) -> None:
        """Be at a position, moving or not, with nowhere to go yet but to rest there."""
        zeros = [0.0] * self.size
        moving = _clipped(velocity or zeros, self._speed_max)
        self.now = MovingPoint(
            position, moving, _clipped(acceleration or zeros, self._acceleration_max)
        )
        self._goal = standing(position)
        self._plan: Trajectory | None = None
        self._since_s = self._plan_s = self._drawn_per_s = 0.0
        self._streams = False
        if any(moving):
            self.go(self._goal)

    @property
    def arrived(self) -> bool:
        """Whether the reference has met its goal."""
        return self._plan is None

    def go(self, goal: Goal) -> None:
        """Go to a goal from here; one that cannot be planned for is not taken: see ``error``."""
        zeros = [0.0] * self.size
        now = self.now
        request = self._input
        request.current_position, request.current_velocity = now.position, now.velocity
        request.current_acceleration = _clipped(now.acceleration, self._acceleration_max)
        plan, at_s, met = Trajectory(self.size), 0.0, False
        request.minimum_duration = None
        self.error = ""
        for _ in range(_TRIES):
            aim = goal(at_s)
            request.target_position = aim.position
            request.target_velocity = _clipped(aim.velocity, self._speed)
            request.target_acceleration = _clipped(aim.acceleration, self._acceleration)
            try:
                self._otg.calculate(request, plan)
            except (RuckigError, ValueError) as error:  # it knows results that have no name
                met = _is_met(now, goal(0.0))
                if met:
                    break
                self.error = " ".join(str(error).split())
                return
            if abs(plan.duration - at_s) < _AGREED_S:
                break
            at_s = plan.duration if aim.velocity == zeros else _SLACK * plan.duration
            request.minimum_duration = at_s
        self._plan, self._goal, self._streams = None if met else plan, goal, False
        self._since_s = self._plan_s = self._drawn_per_s = 0.0

    def stream(self, goal: Goal) -> None:
        """Go to the newest of goals that come one after another, and stay with them smoothly.

        A plan that still ends near them is followed to its end: a new one every few milliseconds
        would be nothing but jerks.
        """
        plan = self._plan
        if plan is not None and self._streams and self._meets(plan, goal):
            self._goal, self._since_s = goal, 0.0
            return
        pull_per_s = self._pull_per_s(self.now, goal(0.0))
        known_per_s = self._drawn_per_s if self._streams else 0.0
        if known_per_s:
            pull_per_s = min(pull_per_s, _STIFFER * known_per_s)
        if pull_per_s < (_PULL_KEPT_PER_S if known_per_s else _PULL_MIN_PER_S):
            self.go(goal)
        else:
            self._plan, self._goal, self._since_s, self.error = None, goal, 0.0, ""
            self._drawn_per_s = pull_per_s
        self._streams = self._streams or not self.error

    def _meets(self, plan: Trajectory, goal: Goal) -> bool:
        """Whether the plan ends so near the goal that the point can be drawn to it from there."""
        left_s = max(0.0, plan.duration - self._plan_s)
        end = MovingPoint(*plan.at_time(plan.duration))
        return self._pull_per_s(end, goal(left_s)) >= _PULL_MIN_PER_S

    def _pull_per_s(self, now: MovingPoint, aim: MovingPoint) -> float:
        """How stiffly a point may be drawn to the goal within the limits; 0 for not at all.

        It is less where the point is far away or has another speed, so that no jerk is cut off:
        cut off, it would swing around the goal.
        """
        pull = _PULL_MAX_PER_S
        for i, (jerk, fastest) in enumerate(zip(self._jerk_max, self._speed, strict=True)):
            gap, change = aim.position[i] - now.position[i], aim.velocity[i] - now.velocity[i]
            while abs(_jerk(pull, gap, change, now.acceleration[i])) > jerk:
                pull *= 0.9
            if abs(aim.velocity[i]) + 0.5 * pull * abs(gap) > fastest:
                return 0.0
        return pull

    def _draw(self, dt_s: float) -> MovingPoint:
        """Move on by one tick: three equal poles, within the limits of acceleration and jerk."""
        aim, k, moved = self._goal(self._since_s), self._drawn_per_s, []
        for p, v, a, g, w, most, jerk in zip(
            *self.now,
            aim.position,
            aim.velocity,
            self._acceleration_max,
            self._jerk_max,
            strict=True,
        ):
            wanted = min(max(_jerk(k, g - p, w - v, a), -jerk), jerk)
            changed = min(max(a + dt_s * wanted, -most), most)
            j = (changed - a) / dt_s
            moved.append(
                (
                    p + dt_s * (v + dt_s * (a / 2.0 + dt_s * j / 6.0)),
                    v + dt_s * (a + changed) / 2.0,
                    changed,
                )
            )
        return MovingPoint(*(list(part) for part in zip(*moved, strict=True)))

    def step(self, dt_s: float) -> MovingPoint:
        """Move on by one tick; return where the reference is then.

        The goal's own time began when it was given to :meth:`go` or :meth:`stream`.
        """
        self._since_s += dt_s
        self._plan_s += dt_s
        if self._plan is not None and self._plan_s < self._plan.duration:
            self.now = MovingPoint(*self._plan.at_time(self._plan_s))
        elif self._streams:
            if self._plan is not None:
                pull_per_s = self._pull_per_s(self.now, self._goal(self._since_s))
                self._drawn_per_s = max(pull_per_s, _PULL_KEPT_PER_S)
            self._plan = None
            self.now = self._draw(dt_s)
        else:
            self._plan = None
            self.now = self._goal(self._since_s)
        return self.now


def _jerk(pull_per_s: float, gap: float, change: float, acceleration: float) -> float:
    """Jerk of a point with three equal poles that lacks a way and a velocity to its goal."""
    return pull_per_s * (pull_per_s * (pull_per_s * gap + 3.0 * change) - 3.0 * acceleration)


def _is_met(now: MovingPoint, aim: MovingPoint) -> bool:
    """Whether only rounding is between a point and its goal; not where either is no number."""
    return all(
        abs(a - b) < _MET
        for have, want in zip(now, aim, strict=True)
        for a, b in zip(have, want, strict=True)
    )


def _clipped(values: list[float], limits: list[float]) -> list[float]:
    return [min(max(value, -limit), limit) for value, limit in zip(values, limits, strict=True)]


def standing(position: list[float]) -> Goal:
    """Return a goal that does not move."""
    zeros = [0.0] * len(position)
    motion = MovingPoint(position, zeros, zeros)
    return lambda ahead_s: motion

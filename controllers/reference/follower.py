"""From targets to what the law is given in every tick: the reference, and the lead before the arm.

A new target never jumps: the reference goes on from where and how fast it is. The arm answers late,
so the reference runs ahead of the tip by the dead time and the lag, and the law is told what the
body must be given to be there: the inverse of the lowest mode,

    u = r + (2 zeta / omega) r' + (1 / omega^2) r''

and for a position the same of what bends the arm, see
:mod:`pneuarm.controllers.reference.mode_inverse`.
"""

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array, Response
from pneuarm.controllers.geometry.moving_point import MovingPoint
from pneuarm.controllers.geometry.rotations import (
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_vector,
    rotation_vector,
    spin_of,
)
from pneuarm.controllers.kinematics.compiled import TipState
from pneuarm.controllers.reference.mode_inverse import ModeInverse
from pneuarm.controllers.reference.stream import STREAM_S, Stream
from pneuarm.controllers.reference.trajectory import (
    FASTEST_SHARE,
    Goal,
    Reference,
    ReferenceLimits,
    standing,
)
from pneuarm.controllers.targets.same import SAME, is_near, same
from pneuarm.controllers.targets.targets import (
    LawName,
    PoseTarget,
    PositionTarget,
    ShapeTarget,
    Target,
)

#: One metre of the limits allows this many radians.
_TURN_PER_M = 10.0

#: Where the law is this far (m) behind, the arm cannot follow: a new target starts at the tip.
_LOST_M = 0.02


#: What moves slower than this (m/s) is a position that stands, and noise.
_STANDS_M_S = 1e-3


@dataclass(frozen=True)
class Lead:
    """By how much (s) the reference runs ahead of the tip, and the inverse of the mode.

    That is how much of the reference's velocity (s) and acceleration (s^2) the command goes ahead.
    """

    ahead_s: float = 0.0
    velocity_s: float = 0.0
    acceleration_s2: float = 0.0


def lead_of(response: Response) -> Lead:
    """Return the lead that undoes dead time, lag and mode.

    A lag that is short beside the mode is as good as a dead time; undone as a lag, it would ask for
    steps wherever the jerk has one.
    """
    omega = 2.0 * math.pi * response.mode_hz
    ahead_s = response.delay_s + response.slower_lag_s
    return Lead(ahead_s, 2.0 * response.damping_ratio / omega, omega**-2)


class Follower:
    """Keeps the reference of position, pose and shape targets; other kinds pass it by."""

    def __init__(
        self, arm: Arm, limits: ReferenceLimits, lead: Lead, gain_per_s: float, period_s: float
    ) -> None:
        turn = ReferenceLimits(
            _TURN_PER_M * limits.speed_m_s,
            _TURN_PER_M * limits.acceleration_m_s2,
            _TURN_PER_M * limits.jerk_m_s3,
        )
        self._position, self._pose = Reference(limits), Reference(limits, turn)
        self._lead, self._gain_per_s, self._jerk_max = lead, gain_per_s, limits.jerk_m_s3
        self._largest_m_s = limits.speed_m_s * 3.0**-0.5
        self.too_fast_m_s = 0.0
        self._inverse = ModeInverse(arm, lead.velocity_s, lead.acceleration_s2)
        self._stream = Stream()
        self._on_the_way: deque[MovingPoint] = deque(maxlen=round(lead.ahead_s / period_s) + 1)
        self.forget()

    def forget(self) -> None:
        """Follow nothing; the next target starts from the tip."""
        self._target: PositionTarget | PoseTarget | ShapeTarget | None = None
        self._reference: Reference | None = None
        self._moving_goal = False
        self._since_s = self._shape_s = 0.0
        self._chart = np.eye(3)
        self._acceleration = [0.0] * 3
        self._stream.forget()
        self._on_the_way.clear()

    @property
    def follows(self) -> bool:
        """Whether there is a reference."""
        return self._reference is not None

    @property
    def arrived(self) -> bool:
        """Whether the reference stands where it was to go."""
        return self._reference is None or (self._reference.arrived and not self._moving_goal)

    @property
    def motion(self) -> MovingPoint | None:
        """Where the tip is to be now: the reference as it was when it was that far ahead."""
        if self._reference is None:
            return None
        return self._on_the_way[0] if self._on_the_way else self._reference.now

    @property
    def goal_position(self) -> list[float]:
        """Where a shape has its point now, met already or not."""
        target = self._target
        if not isinstance(target, ShapeTarget):
            return [math.nan] * 3
        if self._reference is not None and self._reference.arrived:
            return self._on_the_way[0].position
        return target.at(min(self._shape_s, target.duration_s)).position

    @property
    def error(self) -> str:
        """What the generator refused about the newest target; the reference goes on as before."""
        return "" if self._reference is None else self._reference.error

    def set_target(self, target: Target, at_s: float, tip: TipState, velocity_m_s: Array) -> None:
        """Take a target that arrived ``at_s``; the law's tip and velocity say where to start."""
        if not isinstance(target, PositionTarget | PoseTarget | ShapeTarget):
            self.forget()
            return
        if isinstance(target, ShapeTarget):
            if isinstance(self._target, ShapeTarget) and same(target, self._target):
                return
            self._start_position(tip, velocity_m_s)
            self._go(self._position, target.at, moving=True)
            self._shape_s = 0.0
            self._target = target
            return
        velocity = self._velocity(target, at_s)
        if self._is_repeated(target, velocity):
            self._repeat(target)
            return
        if isinstance(target, PositionTarget):
            self._set_position(target, velocity, tip, velocity_m_s)
        else:
            self._set_pose(target, velocity, tip, velocity_m_s)
        self._target = target

    def _go(self, reference: Reference, goal: Goal, moving: bool) -> None:
        reference.go(goal)
        self._reference, self._moving_goal, self._since_s = reference, moving, 0.0

    def _pass(self, reference: Reference, position: list[float], velocity: list[float]) -> None:
        """Be at a position now and move on with a velocity, which is zero unless it streams."""
        zeros, moving = [0.0] * len(position), any(velocity)
        start_s = self._lead.ahead_s

        def at(ahead_s: float) -> MovingPoint:
            moved = [p + (start_s + ahead_s) * v for p, v in zip(position, velocity, strict=True)]
            return MovingPoint(moved, velocity, zeros)

        self._reference, self._moving_goal, self._since_s = reference, moving, 0.0
        (reference.stream if moving else reference.go)(at)

    def _velocity(self, target: PositionTarget | PoseTarget, at_s: float) -> Array:
        """Velocity (3,) of a target: its own, or that of its stream; what the reference can do."""
        streamed = self._stream.velocity(target.position_m, at_s, self._largest_m_s)
        given = target.velocity_m_s if isinstance(target, PositionTarget) else None
        if given is None:
            self.too_fast_m_s = 0.0
            return streamed
        fastest, most = float(np.abs(given).max()), FASTEST_SHARE * self._largest_m_s
        self.too_fast_m_s = math.hypot(*given.tolist()) if fastest > most else 0.0
        # Along the same direction: a goal that ran away from the reference would never be met.
        return given * (most / fastest) if fastest > most else given

    def _is_repeated(self, target: PositionTarget | PoseTarget, velocity: Array) -> bool:
        """Whether the reference stands at this target, or is on its way to it, already."""
        known = self._target
        if type(known) is not type(target) or isinstance(known, ShapeTarget | None):
            return False
        if not is_near(known.position_m, target.position_m) or not _turned_alike(known, target):
            return False
        return self._stream.waits or not (
            self._moving_goal or float(np.abs(velocity).max()) > _STANDS_M_S
        )

    def _repeat(self, target: PositionTarget | PoseTarget) -> None:
        """Take what else it says; where it is stays as it was, or noise would be a motion."""
        known = self._target
        if isinstance(known, PositionTarget | PoseTarget):
            self._target = replace(target, position_m=known.position_m)

    def _set_position(
        self, target: PositionTarget, velocity: Array, tip: TipState, velocity_m_s: Array
    ) -> None:
        self._start_position(tip, velocity_m_s)
        self._pass(self._position, target.position_m.tolist(), velocity.tolist())

    def _set_pose(
        self, target: PoseTarget, velocity: Array, tip: TipState, velocity_m_s: Array
    ) -> None:
        turned = self._start_pose(tip, velocity_m_s)
        wanted = rotation_from_quaternion(target.quaternion_xyzw)
        turn = rotation_vector(wanted @ turned.T).tolist()
        moves = [*velocity.tolist(), 0.0, 0.0, 0.0]
        self._pass(self._pose, [*target.position_m.tolist(), *turn], moves)

    def _linear(self, tip: TipState, velocity_m_s: Array) -> MovingPoint:
        """Where a new way of the position starts: at the reference, or at the tip."""
        reference = self._reference
        if reference is not None:
            position, velocity, acceleration = (part[:3] for part in reference.now)
            if math.dist(position, tip.position_m.tolist()) < self._lost_m(velocity):
                return MovingPoint(position, velocity, acceleration)
        return MovingPoint(tip.position_m.tolist(), velocity_m_s.tolist(), [0.0] * 3)

    def _lost_m(self, velocity: list[float]) -> float:
        """The law is ahead of the reference by the lead: that alone does not make it lost."""
        return _LOST_M + 2.0 * (self._lead.ahead_s + self._lead.velocity_s) * math.hypot(*velocity)

    def _start_position(self, tip: TipState, velocity_m_s: Array) -> None:
        motion = self._linear(tip, velocity_m_s)
        if motion != self._position.now or self._reference is not self._position:
            self._position.start(*motion)

    def _start_pose(self, tip: TipState, velocity_m_s: Array) -> Array:
        """Start where the reference is, in a chart around its rotation, which is returned."""
        linear, zeros = self._linear(tip, velocity_m_s), [0.0, 0.0, 0.0]
        rotation, spin, change = tip.rotation.copy(), zeros, zeros
        if self._reference is self._pose:
            now = self._pose.now
            rotation = rotation_from_vector(np.array(now.position[3:])) @ self._chart
            spin = spin_of(np.array(now.position[3:]), np.array(now.velocity[3:])).tolist()
            change = now.acceleration[3:]
        self._pose.start(
            [*linear.position, *zeros],
            [*linear.velocity, *spin],
            [*linear.acceleration, *change],
        )
        self._chart = rotation
        return rotation

    def step(self, dt_s: float, lengths_m: Array) -> Target | None:
        """Move on by one tick; return the target for the law, None where it has its own.

        ``lengths_m`` (n_sections, 3) are the commanded ones.
        """
        reference = self._reference
        if reference is None or self._target is None:
            return None
        self._since_s += dt_s
        self._shape_s += dt_s
        self._stand_in_the_end(reference)
        motion = reference.step(dt_s)
        self._on_the_way.append(motion)
        if reference is self._position:
            position, velocity, acceleration = (np.array(part) for part in motion)
            ahead = position + self._inverse.way_m(velocity, acceleration, lengths_m)
            rate = np.array(self._rate(motion, dt_s))
            return PositionTarget(ahead, self._target.law, rate, self._nearest_m())
        return self._led_pose(motion, self._target.law)

    def _led_pose(self, motion: MovingPoint, law: LawName) -> PoseTarget:
        """Return the pose for the law, which follows it by its gain alone, 1 / gain behind."""
        by_velocity, by_acceleration = self._lead.velocity_s, self._lead.acceleration_s2
        position, velocity, acceleration = (np.array(part) for part in motion)
        self._acceleration = motion.acceleration[:3]
        ahead = position + by_velocity * velocity + by_acceleration * acceleration
        ahead += (velocity + by_velocity * acceleration) / self._gain_per_s
        turned = rotation_from_vector(ahead[3:]) @ self._chart
        return PoseTarget(ahead[:3], quaternion_from_rotation(turned), law)

    def _rate(self, motion: MovingPoint, dt_s: float) -> list[float]:
        """Velocity (3,) of what the law is given, with the jerk within its limit."""
        by_velocity, by_acceleration = self._lead.velocity_s, self._lead.acceleration_s2
        most, rate = self._jerk_max, []
        for v, a, before in zip(
            motion.velocity, motion.acceleration, self._acceleration, strict=False
        ):
            jerk = min(max((a - before) / dt_s, -most), most)
            rate.append(v + by_velocity * a + by_acceleration * jerk)
        self._acceleration = motion.acceleration
        return rate

    def _nearest_m(self) -> Array | None:
        """Lengths nearest to a position out of reach, once the reference stands there."""
        if isinstance(self._target, PositionTarget) and self.arrived:
            return self._target.nearest_lengths_m
        return None

    def _stand_in_the_end(self, reference: Reference) -> None:
        """Come to rest where a shape is over, or at the last position of a stream."""
        if not self._moving_goal:
            return
        target = self._target
        if isinstance(target, ShapeTarget):
            if self._since_s >= target.duration_s and reference.arrived:
                end = target.at(target.duration_s).position
                self._go(reference, standing(end), moving=False)
        elif self._since_s > STREAM_S and isinstance(target, PositionTarget):
            self._go(reference, standing(target.position_m.tolist()), moving=False)
        elif self._since_s > STREAM_S and isinstance(target, PoseTarget):
            turn = rotation_vector(rotation_from_quaternion(target.quaternion_xyzw) @ self._chart.T)
            end = [*target.position_m.tolist(), *turn.tolist()]
            self._go(reference, standing(end), moving=False)


def _turned_alike(one: PositionTarget | PoseTarget, other: PositionTarget | PoseTarget) -> bool:
    """Whether two poses have the same orientation; positions have none."""
    if not (isinstance(one, PoseTarget) and isinstance(other, PoseTarget)):
        return True
    alike = abs(float(one.quaternion_xyzw @ other.quaternion_xyzw))
    # Quaternions d apart have a product of 1 - d^2 / 2.
    return alike >= 1.0 - 0.5 * SAME**2

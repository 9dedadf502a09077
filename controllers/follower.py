"""From targets to what the law is given in every tick: the reference, and the lead before the arm.

A new target never jumps: the reference goes on from where and how fast it is. The arm answers late,
so the law is told where the reference will be when the air and the body have followed: the inverse
of the response's lag and mode,

    u = r + (delay + lag + 2 zeta / omega) r' + (1 / omega^2 + 2 zeta lag / omega) r''
"""

import math
from dataclasses import dataclass

import numpy as np

from controllers.arm import Array, Response
from controllers.frames import rotation_from_vector, rotation_vector
from controllers.kinematics.compiled import TipState
from controllers.targets import PoseTarget, PositionTarget, ShapeTarget, Target
from controllers.tasks.tip_pose import (
    quaternion_from_rotation,
    rotation_from_quaternion,
)
from controllers.trajectory import Goal, Motion, Reference, ReferenceLimits, standing

#: One metre of the limits allows this many radians.
_TURN_PER_M = 10.0

#: Positions that arrive this close together (s) and move are a stream; without the next one for
#: as long, the reference goes to the last one and stands.
_STREAM_S = 0.1

#: Share of the newest step in the speed of a stream: arrival times jitter.
_NEWEST = 0.4

#: Where the law is this far (m) behind, the arm cannot follow: a new target starts at the tip.
_LOST_M = 0.02


@dataclass(frozen=True)
class Lead:
    """How much of the reference's velocity (s) and acceleration (s^2) the command goes ahead."""

    velocity_s: float = 0.0
    acceleration_s2: float = 0.0


def lead_of(response: Response) -> Lead:
    """Return the lead that undoes dead time, lag and mode, to second order."""
    omega = 2.0 * math.pi * response.mode_hz
    swing_s = 2.0 * response.damping_ratio / omega
    return Lead(response.delay_s + response.lag_s + swing_s, omega**-2 + swing_s * response.lag_s)


class _Stream:
    """The speed of positions that arrive one after another."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        self._position: Array | None = None
        self._at_s = 0.0
        self._velocity: Array | None = None

    def velocity(self, position_m: Array, at_s: float, largest_m_s: float) -> Array:
        """Speed (3,) of a stream; zero for a position that is repeated or stands alone."""
        before, pause_s = self._position, at_s - self._at_s
        self._position, self._at_s = position_m, at_s
        if before is None or not 0.0 < pause_s <= _STREAM_S:
            self._velocity = None
            return np.zeros(3)
        newest = (position_m - before) / pause_s
        if not 0.0 < float(np.abs(newest).max()) <= largest_m_s:
            self._velocity = None
            return np.zeros(3)
        known = self._velocity
        self._velocity = newest if known is None else known + _NEWEST * (newest - known)
        return np.zeros(3) if known is None else self._velocity


class Follower:
    """Keeps the reference of position, pose and shape targets; other kinds pass it by."""

    def __init__(self, limits: ReferenceLimits, lead: Lead, gain_per_s: float) -> None:
        turn = ReferenceLimits(
            _TURN_PER_M * limits.speed_m_s,
            _TURN_PER_M * limits.acceleration_m_s2,
            _TURN_PER_M * limits.jerk_m_s3,
        )
        self._position, self._pose = Reference(limits), Reference(limits, turn)
        self._lead, self._gain_per_s, self._jerk_max = lead, gain_per_s, limits.jerk_m_s3
        self._largest_m_s = limits.speed_m_s * 3.0**-0.5
        self._stream = _Stream()
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

    @property
    def follows(self) -> bool:
        """Whether there is a reference."""
        return self._reference is not None

    @property
    def arrived(self) -> bool:
        """Whether the reference stands where it was to go."""
        return self._reference is None or (self._reference.arrived and not self._moving_goal)

    @property
    def motion(self) -> Motion | None:
        """The reference now."""
        return None if self._reference is None else self._reference.now

    @property
    def goal_position(self) -> list[float]:
        """Where a shape has its point now, met already or not."""
        target = self._target
        if not isinstance(target, ShapeTarget):
            return [math.nan] * 3
        if self._reference is not None and self._reference.arrived:
            return self._reference.now.position
        return target.shape.at(min(self._shape_s, target.shape.duration_s)).position

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
            known = self._target
            if isinstance(known, ShapeTarget) and known.key == target.key:
                return
            self._start_position(tip, velocity_m_s)
            self._go(self._position, target.shape.at, moving=True)
            self._shape_s = 0.0
        elif isinstance(target, PositionTarget):
            self._set_position(target, at_s, tip, velocity_m_s)
        else:
            self._set_pose(target, at_s, tip, velocity_m_s)
        self._target = target

    def _go(self, reference: Reference, goal: Goal, moving: bool) -> None:
        reference.go(goal)
        self._reference, self._moving_goal, self._since_s = reference, moving, 0.0

    def _velocity(self, target: PositionTarget | PoseTarget, at_s: float) -> Array:
        streamed = self._stream.velocity(target.position_m, at_s, self._largest_m_s)
        given = target.velocity_m_s if isinstance(target, PositionTarget) else None
        return streamed if given is None else given

    def _is_repeated(self, target: PositionTarget | PoseTarget, velocity: Array) -> bool:
        """Whether the reference stands at this target, or is on its way to it, already."""
        known = self._target
        if self._moving_goal or velocity.any():
            return False
        if isinstance(target, PoseTarget):
            return (
                isinstance(known, PoseTarget)
                and bool((known.position_m == target.position_m).all())
                and bool((known.quaternion_xyzw == target.quaternion_xyzw).all())
            )
        return isinstance(known, PositionTarget) and bool(
            (known.position_m == target.position_m).all()
        )

    def _set_position(
        self, target: PositionTarget, at_s: float, tip: TipState, velocity_m_s: Array
    ) -> None:
        velocity = self._velocity(target, at_s)
        if self._is_repeated(target, velocity):
            return
        self._start_position(tip, velocity_m_s)
        goal = _passing(target.position_m.tolist(), velocity.tolist())
        self._go(self._position, goal, moving=bool(velocity.any()))

    def _set_pose(
        self, target: PoseTarget, at_s: float, tip: TipState, velocity_m_s: Array
    ) -> None:
        velocity = self._velocity(target, at_s)
        if self._is_repeated(target, velocity):
            return
        turned = self._start_pose(tip, velocity_m_s)
        wanted = rotation_from_quaternion(target.quaternion_xyzw)
        turn = rotation_vector(wanted @ turned.T).tolist()
        goal = _passing([*target.position_m.tolist(), *turn], [*velocity.tolist(), 0.0, 0.0, 0.0])
        self._go(self._pose, goal, moving=bool(velocity.any()))

    def _linear(self, tip: TipState, velocity_m_s: Array) -> Motion:
        """Where a new way of the position starts: at the reference, or at the tip."""
        reference = self._reference
        if reference is not None:
            position, velocity, acceleration = (part[:3] for part in reference.now)
            if math.dist(position, tip.position_m.tolist()) < self._lost_m(velocity):
                return Motion(position, velocity, acceleration)
        return Motion(tip.position_m.tolist(), velocity_m_s.tolist(), [0.0] * 3)

    def _lost_m(self, velocity: list[float]) -> float:
        """The law is ahead of the reference by the lead: that alone does not make it lost."""
        return _LOST_M + 2.0 * self._lead.velocity_s * math.hypot(*velocity)

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
            spin = _spin(np.array(now.position[3:]), np.array(now.velocity[3:])).tolist()
            change = now.acceleration[3:]
        self._pose.start(
            [*linear.position, *zeros],
            [*linear.velocity, *spin],
            [*linear.acceleration, *change],
        )
        self._chart = rotation
        return rotation

    def step(self, dt_s: float) -> Target | None:
        """Move on by one tick; return the target for the law, None where it has its own."""
        reference = self._reference
        if reference is None or self._target is None:
            return None
        self._since_s += dt_s
        self._shape_s += dt_s
        self._stand_in_the_end(reference)
        motion = reference.step(dt_s)
        by_velocity, by_acceleration = self._lead.velocity_s, self._lead.acceleration_s2
        ahead = np.array(
            [p + by_velocity * v + by_acceleration * a for p, v, a in zip(*motion, strict=True)]
        )
        if reference is self._position:
            rate = np.array(self._rate(motion, dt_s))
            return PositionTarget(ahead, self._target.law, rate, self._nearest_m())
        # The law follows a pose by its gain alone, 1 / gain behind.
        _, velocity, acceleration = (np.array(part) for part in motion)
        self._acceleration = motion.acceleration[:3]
        ahead += (velocity + by_velocity * acceleration) / self._gain_per_s
        turned = rotation_from_vector(ahead[3:]) @ self._chart
        return PoseTarget(ahead[:3], quaternion_from_rotation(turned), self._target.law)

    def _rate(self, motion: Motion, dt_s: float) -> list[float]:
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
            if self._since_s >= target.shape.duration_s and reference.arrived:
                end = target.shape.at(target.shape.duration_s).position
                self._go(reference, standing(end), moving=False)
        elif self._since_s > _STREAM_S and isinstance(target, PositionTarget):
            self._go(reference, standing(target.position_m.tolist()), moving=False)
        elif self._since_s > _STREAM_S and isinstance(target, PoseTarget):
            turn = rotation_vector(rotation_from_quaternion(target.quaternion_xyzw) @ self._chart.T)
            end = [*target.position_m.tolist(), *turn.tolist()]
            self._go(reference, standing(end), moving=False)


def _passing(position: list[float], velocity: list[float]) -> Goal:
    """Return a goal that is at a position now and moves on with a velocity."""
    zeros = [0.0] * len(position)

    def at(ahead_s: float) -> Motion:
        moved = [p + ahead_s * v for p, v in zip(position, velocity, strict=True)]
        return Motion(moved, velocity, zeros)

    return at


def _spin(turn: Array, rate: Array) -> Array:
    """Angular velocity (3,) of exp(turn) whose rotation vector changes at a rate (3,)."""
    angle = float(np.sqrt(turn @ turn))
    if angle < 1e-9:
        return rate
    axis = turn / angle
    sine = math.sin(angle) / angle
    along: Array = axis * (axis @ rate)
    across = (1.0 - math.cos(angle)) / angle * np.cross(axis, rate)
    return sine * rate + (1.0 - sine) * along + across

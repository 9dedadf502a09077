"""What the daemon can be asked for: one frozen class a kind, in SI units and the base frame."""

from dataclasses import dataclass
from enum import IntEnum

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.targets.shapes import Shape


class LawName(IntEnum):
    """The laws, numbered as on the wire."""

    DEFAULT = 0
    RESOLVED_RATE = 1
    QP_IK = 2


class TargetKind(IntEnum):
    """The kinds of target, numbered as on the wire."""

    NONE = 0
    POSITION = 1
    POSE = 2
    TWIST = 3
    LENGTHS = 4
    PRESSURES = 5
    DIRECTION = 6
    POINT = 7
    TASKS = 8
    TRAJECTORY = 10
    CIRCLE = 11
    LINE = 12


@dataclass(frozen=True)
class PositionTarget:
    """Tip at ``position_m`` (3,), a point that moves with ``velocity_m_s`` (3,) if one is given.

    ``nearest_lengths_m`` (n_sections, 3) are the lengths that bring the tip nearest, for a position
    out of reach, from :meth:`pneuarm.controllers.workspace.workspace.Workspace.is_reachable`:
    finding them takes too long for a tick.
    """

    position_m: Array
    law: LawName = LawName.DEFAULT
    velocity_m_s: Array | None = None
    nearest_lengths_m: Array | None = None


@dataclass(frozen=True)
class PoseTarget:
    """Tip at ``position_m`` (3,) in the orientation ``quaternion_xyzw`` (4,), a unit quaternion."""

    position_m: Array
    quaternion_xyzw: Array
    law: LawName = LawName.DEFAULT


@dataclass(frozen=True)
class TwistTarget:
    """Tip twist; see :class:`pneuarm.controllers.tasks.tip_twist.TipTwist` for frame and point."""

    linear_m_s: Array
    angular_rad_s: Array | None
    in_tip_frame: bool
    about_base_origin: bool
    law: LawName = LawName.DEFAULT


@dataclass(frozen=True)
class LengthsTarget:
    """Chambers at ``lengths_m`` (n_sections, 3)."""

    lengths_m: Array
    law: LawName = LawName.DEFAULT


@dataclass(frozen=True)
class PressuresTarget:
    """Chambers at gauge ``pressures_pa`` (n_sections, 3), through the map and the same limits."""

    pressures_pa: Array
    law: LawName = LawName.DEFAULT


@dataclass(frozen=True)
class DirectionTarget:
    """The tip's z axis along ``direction`` (3,), a unit vector; roll and position free."""

    direction: Array
    law: LawName = LawName.DEFAULT


@dataclass(frozen=True)
class PointTarget:
    """The backbone's point at ``station`` (0 the base, 1 the tip) at ``position_m`` (3,)."""

    position_m: Array
    station: float
    law: LawName = LawName.DEFAULT


@dataclass(frozen=True)
class PostureTarget:
    """Chambers near the middle of their bounds, with what other tasks leave; only in a list."""

    law: LawName = LawName.DEFAULT


WeightedTarget = (
    PositionTarget | PoseTarget | LengthsTarget | DirectionTarget | PointTarget | PostureTarget
)


@dataclass(frozen=True)
class TasksTarget:
    """Several at once; ``weights`` has a row a task: its weight, and a pose's for orientation."""

    targets: tuple[WeightedTarget, ...]
    weights: tuple[tuple[float, float], ...]
    law: LawName = LawName.DEFAULT


@dataclass(frozen=True)
class ShapeTarget:
    """Tip along a shape, whose own time begins when its ``key`` first arrives."""

    shape: Shape
    key: int
    law: LawName = LawName.DEFAULT


class TrajectoryTarget(ShapeTarget):
    """Tip through timed waypoints."""


class CircleTarget(ShapeTarget):
    """Tip on a circle."""


class LineTarget(ShapeTarget):
    """Tip on a line, there and back."""


Target = (
    PositionTarget
    | PoseTarget
    | TwistTarget
    | LengthsTarget
    | PressuresTarget
    | DirectionTarget
    | PointTarget
    | TasksTarget
    | TrajectoryTarget
    | CircleTarget
    | LineTarget
)

KIND_OF = {
    PositionTarget: TargetKind.POSITION,
    PoseTarget: TargetKind.POSE,
    TwistTarget: TargetKind.TWIST,
    LengthsTarget: TargetKind.LENGTHS,
    PressuresTarget: TargetKind.PRESSURES,
    DirectionTarget: TargetKind.DIRECTION,
    PointTarget: TargetKind.POINT,
    TasksTarget: TargetKind.TASKS,
    TrajectoryTarget: TargetKind.TRAJECTORY,
    CircleTarget: TargetKind.CIRCLE,
    LineTarget: TargetKind.LINE,
}

"""Every kind of target, and what the laws must be compiled for because of them."""

from collections.abc import Mapping

from pneuarm.controllers.targets.chambers import LengthsTarget, PostureTarget, PressuresTarget
from pneuarm.controllers.targets.circle import CircleTarget
from pneuarm.controllers.targets.direction import DirectionTarget
from pneuarm.controllers.targets.line import LineTarget
from pneuarm.controllers.targets.point import PointTarget
from pneuarm.controllers.targets.pose import PoseTarget
from pneuarm.controllers.targets.position import PositionTarget
from pneuarm.controllers.targets.shape import ShapeTarget
from pneuarm.controllers.targets.target import LawName, Target
from pneuarm.controllers.targets.together import TasksTarget
from pneuarm.controllers.targets.trajectory import TrajectoryTarget
from pneuarm.controllers.targets.twist import TwistTarget

#: By the field of the message ``pneuarm.Target``.
KINDS: Mapping[str, type[Target]] = {
    kind.name: kind
    for kind in (
        PositionTarget,
        PoseTarget,
        TwistTarget,
        LengthsTarget,
        PressuresTarget,
        DirectionTarget,
        PointTarget,
        TasksTarget,
        TrajectoryTarget,
        CircleTarget,
        LineTarget,
    )
}

#: Parameters of single kinds in what is wanted, beside those that all share.
PARTS: Mapping[str, int] = {
    name: size for kind in KINDS.values() for name, size in kind.parts.items()
}

#: What gives the rows of single kinds.
ROWS = tuple(kind.rows for kind in KINDS.values() if kind.parts)

__all__ = [
    "KINDS",
    "PARTS",
    "ROWS",
    "CircleTarget",
    "DirectionTarget",
    "LawName",
    "LengthsTarget",
    "LineTarget",
    "PointTarget",
    "PoseTarget",
    "PositionTarget",
    "PostureTarget",
    "PressuresTarget",
    "ShapeTarget",
    "Target",
    "TasksTarget",
    "TrajectoryTarget",
    "TwistTarget",
]

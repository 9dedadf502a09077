"""What a target asks for, as rows in numpy, and targets of which a posture is the goal."""

from functools import cache

import casadi as ca
import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.geometry.rotations import (
    quaternion_from_rotation,
)
from pneuarm.controllers.kinematics.constant_curvature import (
    section_transforms,
    shapes_from_lengths,
)
from pneuarm.controllers.kinematics.constant_curvature import tip_transform as tip_of
from pneuarm.controllers.targets.targets import (
    PARTS,
    ROWS,
    DirectionTarget,
    LengthsTarget,
    PointTarget,
    PoseTarget,
    PositionTarget,
    Target,
    TasksTarget,
)
from pneuarm.controllers.tasks.rows import Rows, symbolic_rows
from pneuarm.controllers.tasks.wanted import Wanted, symbols


@cache
def compiled(arm: Arm) -> ca.Function:
    lengths = ca.SX.sym("lengths", arm.n_chambers)
    vector, want = symbols(arm.n_chambers, PARTS)
    rows = symbolic_rows(arm, lengths, want, ROWS, whole=True)
    return ca.Function("rows", [lengths, vector], ca.cse(list(rows)))


def rows_at(arm: Arm, lengths: Array, task: Target, correction: Array | None = None) -> Rows:
    """Rows of a task as numpy arrays; vectors are flat."""
    wanted = Wanted(arm.n_chambers, PARTS)
    task.ask(wanted, 30.0, 1.0)
    if correction is not None:
        wanted.correct(correction[:3, 3], correction[:3, :3])
    results = [np.array(part) for part in compiled(arm)(lengths.reshape(-1), wanted.values)]
    return Rows(*(part.reshape(-1) if part.shape[1] == 1 else part for part in results))


def point_at(arm: Arm, lengths: Array, station: float) -> Array:
    """Position of a backbone's point, the slow way."""
    transform = np.eye(4)
    shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))
    for index, shape in enumerate(shapes):
        share = np.clip(station * arm.n_sections - index, 0.0, 1.0)
        transform = transform @ section_transforms(share * shape)
    return transform[:3, 3]


def pose_of(position_m: Array, rotation: Array) -> PoseTarget:
    return PoseTarget(position_m, quaternion_from_rotation(rotation))


def task_with_goal(kind: str, arm: Arm, goal: Array) -> Target:
    tip = tip_of(arm, goal)
    point = PointTarget(point_at(arm, goal, 0.6), 0.6, weight=2.0)
    match kind:
        case "position":
            return PositionTarget(tip[:3, 3])
        case "pose":
            return PoseTarget(
                tip[:3, 3],
                quaternion_from_rotation(tip[:3, :3]),
                weight=2.0,
                orientation_weight=0.5,
            )
        case "direction":
            return DirectionTarget(tip[:3, 2], weight=3.0)
        case "point":
            return point
        case "combined":
            direction = DirectionTarget(tip[:3, 2], weight=0.3)
            return TasksTarget((PositionTarget(tip[:3, 3]), direction, point))
    return LengthsTarget(goal)

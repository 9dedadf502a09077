"""The task of a target: from what was asked for to what the laws follow."""

import numpy as np

from pneuarm.controllers.actuation.pressure_map import PressureMap, length_bounds_m
from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.geometry.rotations import rotation_from_quaternion
from pneuarm.controllers.targets.targets import (
    DirectionTarget,
    LengthsTarget,
    PointTarget,
    PoseTarget,
    PositionTarget,
    PostureTarget,
    PressuresTarget,
    ShapeTarget,
    Target,
    TasksTarget,
    TwistTarget,
    WeightedTarget,
)
from pneuarm.controllers.tasks.backbone_point import BackbonePoint
from pneuarm.controllers.tasks.chamber_lengths import ChamberLengths, Posture
from pneuarm.controllers.tasks.task import Combined, Task
from pneuarm.controllers.tasks.tip_direction import TipDirection
from pneuarm.controllers.tasks.tip_pose import TipPose
from pneuarm.controllers.tasks.tip_position import TipPosition
from pneuarm.controllers.tasks.tip_twist import TipTwist


class TaskMaker:
    """Makes the tasks of one arm's targets."""

    def __init__(self, arm: Arm) -> None:
        self._pressure_map, self._bounds_m = PressureMap(arm), length_bounds_m(arm)

    def task(self, target: Target) -> Task:
        """Return what the laws follow for a target."""
        match target:
            case TwistTarget():
                return TipTwist(
                    target.linear_m_s,
                    target.angular_rad_s,
                    target.in_tip_frame,
                    target.about_base_origin,
                )
            case PressuresTarget():
                lengths = self._pressure_map.lengths_m(target.pressures_pa)
                return ChamberLengths(np.clip(lengths, *self._bounds_m))
            case TasksTarget():
                pairs = zip(target.targets, target.weights, strict=True)
                return Combined(tuple(weighted(part, *weights) for part, weights in pairs))
            case ShapeTarget():
                raise InvalidInput("a shape comes to the law as the positions along it")
        return weighted(target, 1.0, 1.0)


def weighted(target: WeightedTarget, weight: float, orientation_weight: float) -> Task:
    """Return the task of one target beside others."""
    match target:
        case PositionTarget():
            return TipPosition(target.position_m, target.velocity_m_s, weight)
        case PoseTarget():
            rotation = rotation_from_quaternion(target.quaternion_xyzw)
            return TipPose(target.position_m, rotation, weight, orientation_weight)
        case LengthsTarget():
            return ChamberLengths(target.lengths_m, weight)
        case DirectionTarget():
            return TipDirection(target.direction, weight)
        case PointTarget():
            return BackbonePoint(target.position_m, target.station, weight)
        case PostureTarget():
            return Posture(weight)

"""A message becomes a command only through here: frames, units, limits, finiteness, freshness."""

import numpy as np
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf.message import Message

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput, TargetRejected
from pneuarm.controllers.geometry.mountings import Mountings, Transform
from pneuarm.controllers.geometry.rotations import (
    quaternion_from_rotation,
    rotation_from_quaternion,
)
from pneuarm.controllers.reference.trajectory import ReferenceLimits
from pneuarm.controllers.targets.targets import (
    DirectionTarget,
    LawName,
    LengthsTarget,
    PointTarget,
    PoseTarget,
    PositionTarget,
    PostureTarget,
    PressuresTarget,
    Target,
    TasksTarget,
    TwistTarget,
    WeightedTarget,
)
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.wire.shape_checks import ShapeChecker

#: A position farther than this many arm lengths is not a position in metres.
FARTHEST_ARM_LENGTHS = 3.0

#: No soft arm moves its tip faster (m/s), or turns it faster (rad/s).
FASTEST_M_S = 5.0
FASTEST_RAD_S = 20.0

_UNIT_TOLERANCE = 1e-3

#: Weights count beside each other; beyond this the QP loses the digits of the others.
_HEAVIEST = 1e3

#: Tasks that ask for the same thing, so that only one of them can be meant.
_CONTRADICTORY = (("position", "pose"), ("direction", "pose"))


class TargetChecker:
    """Turns target messages for one arm into checked targets; raises TargetRejected."""

    def __init__(
        self,
        arm: Arm,
        frames: Mountings | None = None,
        reference: ReferenceLimits | None = None,
    ) -> None:
        self._arm = arm
        self._frames = frames or Mountings()
        self._shapes = ShapeChecker(arm, reference or ReferenceLimits(), self._position)
        self._farthest_m = FARTHEST_ARM_LENGTHS * arm.max_length_m
        self._length_low, self._length_high = length_bounds_m(arm)
        self._pressure_low = arm.per_chamber("pressure_min_pa")
        self._pressure_high = arm.per_chamber("pressure_max_pa")

    def target(self, message: pb.Target) -> Target:
        """Check one message."""
        law = _law(message.law)
        match message.WhichOneof("target"):
            case "position":
                _require(message.position, "position_m")
                position = self._position(message.position.frame_id, message.position.position_m)
                return PositionTarget(position, law, _velocity(message.position))
            case "pose":
                _require(message.pose, "position_m", "orientation")
                position = self._position(message.pose.frame_id, message.pose.position_m)
                return PoseTarget(position, _quaternion(message.pose.orientation), law)
            case "twist":
                return _twist(message.twist, law)
            case "lengths":
                return LengthsTarget(self._lengths(message.lengths), law)
            case "pressures":
                return PressuresTarget(self._pressures(message.pressures), law)
            case "direction":
                return DirectionTarget(_direction(message.direction), law)
            case "point":
                return self._point(message.point, law)
            case "tasks":
                return self._tasks(message.tasks, law)
            case "trajectory" | "circle" | "line":
                return self._shapes.target(message, law)
        raise TargetRejected(
            "the message holds no target; one of position, pose, twist, lengths, pressures, "
            "direction, point, tasks, trajectory, circle, line"
        )

    def _point(self, message: pb.PointTarget, law: LawName = LawName.DEFAULT) -> PointTarget:
        _require(message, "position_m")
        if not 0.0 < message.station <= 1.0:  # never true of a NaN
            raise TargetRejected(
                f"station = {message.station:g}; allowed: above 0 (the base) to 1 (the tip)"
            )
        position = self._position(message.frame_id, message.position_m)
        along = message.station * self._arm.n_sections
        shares = np.clip(along - np.arange(self._arm.n_sections), 0.0, 1.0)
        longest = float(shares @ self._arm.per_section("length_max_m")[:, 0])
        distance = float(np.linalg.norm(position))
        if distance > longest:
            raise TargetRejected(
                f"position_m = {_list(position)} is {distance:.3g} m from the base, but the "
                f"backbone at station {message.station:g} reaches at most {longest:.3g} m"
            )
        return PointTarget(position, message.station, law)

    def _tasks(self, message: pb.TasksTarget, law: LawName) -> TasksTarget:
        kinds = [task.WhichOneof("task") for task in message.tasks]
        if not [kind for kind in kinds if kind not in (None, "posture")]:
            raise TargetRejected("tasks holds no task besides posture; at least one is needed")
        for kind in kinds:
            if kinds.count(kind) > 1:
                raise TargetRejected(
                    f"tasks holds {kind or 'an empty task'} twice; once is allowed"
                )
        for one, other in _CONTRADICTORY:
            if one in kinds and other in kinds:
                raise TargetRejected(f"tasks holds {one} and {other}, which contradict; drop one")
        if "position" in kinds + ["position"] * ("pose" in kinds) and any(
            task.HasField("point") and task.point.station == 1.0 for task in message.tasks
        ):
            raise TargetRejected(
                "tasks holds a point at station 1, the tip, besides the tip's position; drop one"
            )
        targets = tuple(self._task(task) for task in message.tasks)
        return TasksTarget(targets, tuple(_weights(task) for task in message.tasks), law)

    def _task(self, message: pb.WeightedTask) -> WeightedTarget:
        """Check one of several tasks."""
        match message.WhichOneof("task"):
            case "position":
                _require(message.position, "position_m")
                position = message.position
                return PositionTarget(self._position(position.frame_id, position.position_m))
            case "pose":
                _require(message.pose, "position_m", "orientation")
                place = self._position(message.pose.frame_id, message.pose.position_m)
                return PoseTarget(place, _quaternion(message.pose.orientation))
            case "direction":
                return DirectionTarget(_direction(message.direction))
            case "point":
                return self._point(message.point)
            case "lengths":
                return LengthsTarget(self._lengths(message.lengths))
            case "posture":
                return PostureTarget()
        raise TargetRejected(
            "an empty task; one of position, pose, direction, point, lengths, posture"
        )

    def tip_pose(self, message: PoseInFrame) -> tuple[Array, Array]:
        """Check a measured marker pose; return the tip's position (3,) and quaternion (4,).

        Both are in the base frame; the position is the tool point's.
        """
        _require(message, "pose")
        _require(message.pose, "position", "orientation")
        rotation = rotation_from_quaternion(_quaternion(message.pose.orientation))
        marker = Transform(rotation, _vector("position", message.pose.position))
        try:
            tool = self._frames.tool_pose(marker, message.frame_id)
        except InvalidInput as error:
            raise TargetRejected(str(error)) from error
        self._check_near(tool.position_m)
        return tool.position_m, quaternion_from_rotation(tool.rotation)

    def _position(self, frame_id: str, vector: object) -> Array:
        _check_frame(frame_id, ("base",))
        position = _vector("position_m", vector)
        self._check_near(position)
        return position

    def _check_near(self, position: Array) -> None:
        distance = float(np.linalg.norm(position))
        if distance > self._farthest_m:
            raise TargetRejected(
                f"position_m = {_list(position)} is {distance:.3g} m from the base, more than "
                f"{FARTHEST_ARM_LENGTHS:g} arm lengths; is it in mm?"
            )

    def _lengths(self, message: pb.LengthsTarget) -> Array:
        return self._chambers(
            "length_m", list(message.length_m), self._length_low, self._length_high, "m"
        )

    def _pressures(self, message: pb.PressuresTarget) -> Array:
        return self._chambers(
            "pressure_pa", list(message.pressure_pa), self._pressure_low, self._pressure_high, "Pa"
        )

    def _chambers(
        self, name: str, values: list[float], low: Array, high: Array, unit: str
    ) -> Array:
        if len(values) != self._arm.n_chambers:
            raise TargetRejected(
                f"{name} has {len(values)} values; arm {self._arm.name} has "
                f"{self._arm.n_chambers} chambers"
            )
        array = np.array(values, dtype=np.float64).reshape(low.shape)
        _check_finite(name, array)
        outside = (array < low) | (array > high)
        if outside.any():
            section, chamber = (int(index[0]) for index in np.nonzero(outside))
            raise TargetRejected(
                f"{name} of section {section + 1}, chamber {chamber + 1} is "
                f"{array[section, chamber]:.6g} {unit}; allowed: {low[section, chamber]:.6g} to "
                f"{high[section, chamber]:.6g} {unit}"
            )
        return array


def _law(number: int) -> LawName:
    try:
        return LawName(number)
    except ValueError:
        raise TargetRejected(
            f"law = {number}; allowed: 0 (the configured one), 1 (resolved rate), 2 (QP)"
        ) from None


def _velocity(message: pb.PositionTarget) -> Array | None:
    if not message.HasField("velocity_m_s"):
        return None
    velocity = _vector("velocity_m_s", message.velocity_m_s)
    if np.linalg.norm(velocity) > FASTEST_M_S:
        raise TargetRejected(
            f"velocity_m_s = {_list(velocity)} is above {FASTEST_M_S:g} m/s; is it in mm/s?"
        )
    return velocity


def _twist(message: pb.TwistTarget, law: LawName) -> TwistTarget:
    _check_frame(message.frame_id, ("base", "tip"))
    if message.reference_point not in ("base", "tip"):
        raise TargetRejected(
            f"reference_point = {message.reference_point!r}; allowed: 'base', 'tip'"
        )
    _require(message, "linear_m_s")
    linear = _vector("linear_m_s", message.linear_m_s)
    if np.linalg.norm(linear) > FASTEST_M_S:
        raise TargetRejected(
            f"linear_m_s = {_list(linear)} is above {FASTEST_M_S:g} m/s; is it in mm/s?"
        )
    angular = None
    if message.HasField("angular_rad_s"):
        angular = _vector("angular_rad_s", message.angular_rad_s)
        if np.linalg.norm(angular) > FASTEST_RAD_S:
            raise TargetRejected(
                f"angular_rad_s = {_list(angular)} is above {FASTEST_RAD_S:g} rad/s; "
                "is it in degrees?"
            )
    about_base = message.reference_point == "base"
    if about_base and angular is None:
        raise TargetRejected("reference_point = 'base' needs angular_rad_s as well")
    in_tip_frame = message.frame_id == "tip"
    if in_tip_frame and about_base:
        raise TargetRejected("frame_id = 'tip' goes with reference_point = 'tip' only")
    return TwistTarget(linear, angular, in_tip_frame, about_base, law)


def _direction(message: pb.DirectionTarget) -> Array:
    _check_frame(message.frame_id, ("base",))
    _require(message, "direction")
    direction = _vector("direction", message.direction)
    norm = float(np.linalg.norm(direction))
    if not 1e-6 < norm < 1e6:
        raise TargetRejected(f"direction = {_list(direction)} points nowhere; give a unit vector")
    return direction / norm


def _weights(message: pb.WeightedTask) -> tuple[float, float]:
    for name in ("weight", "orientation_weight"):
        weight = getattr(message, name)
        left_out = name == "orientation_weight" and weight == 0.0
        if not (0.0 < weight <= _HEAVIEST or left_out):
            raise TargetRejected(
                f"{name} of task {message.WhichOneof('task')} is {weight:g}; allowed: above 0 to "
                f"{_HEAVIEST:g}; leave out a task that is not to count"
            )
    return message.weight, message.orientation_weight or message.weight


def _require(message: Message, *names: str) -> None:
    """Refuse a message that leaves a field out: protobuf would read it as zeros."""
    for name in names:
        if not message.HasField(name):
            raise TargetRejected(f"{name} is missing")


def _check_frame(frame_id: str, allowed: tuple[str, ...]) -> None:
    if frame_id not in allowed:
        names = ", ".join(repr(name) for name in allowed)
        raise TargetRejected(f"frame_id = {frame_id!r}: unknown frame; allowed: {names}")


def _check_finite(name: str, values: Array) -> None:
    if not np.isfinite(values).all():
        raise TargetRejected(f"{name} = {_list(values)}: every value must be finite")


def _vector(name: str, message: object) -> Array:
    vector = np.array([getattr(message, axis) for axis in "xyz"], dtype=np.float64)
    _check_finite(name, vector)
    return vector


def _quaternion(message: object) -> Array:
    quaternion = np.array([getattr(message, axis) for axis in "xyzw"], dtype=np.float64)
    _check_finite("orientation", quaternion)
    norm = float(np.linalg.norm(quaternion))
    if abs(norm - 1.0) > _UNIT_TOLERANCE:
        raise TargetRejected(
            f"orientation = {_list(quaternion)} has the norm {norm:.4g}; a unit quaternion "
            "(x, y, z, w) is needed"
        )
    return quaternion / norm


def _list(values: Array) -> str:
    return "[" + ", ".join(f"{value:.4g}" for value in values.reshape(-1)) + "]"

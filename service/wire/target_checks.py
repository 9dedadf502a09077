"""A message becomes a target, or a measured tip pose, only through here."""

from typing import Any

import numpy as np
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf.message import Message

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput, TargetRejected
from pneuarm.controllers.geometry.mountings import Mountings, Transform
from pneuarm.controllers.geometry.rotations import (
    quaternion_from_rotation,
    rotation_from_quaternion,
)
from pneuarm.controllers.reference.trajectory import ReferenceLimits
from pneuarm.controllers.targets import checks
from pneuarm.controllers.targets.same import same
from pneuarm.controllers.targets.targets import KINDS, LawName, ShapeTarget, Target
from pneuarm.controllers.workspace.workspace import Workspace
from pneuarm.logs.schema import pneuarm_pb2 as pb


class TargetChecker:
    """Turns target messages for one arm into checked targets; raises TargetRejected."""

    def __init__(
        self,
        arm: Arm,
        mountings: Mountings | None = None,
        reference: ReferenceLimits | None = None,
    ) -> None:
        self._mountings = mountings or Mountings()
        limits = reference or ReferenceLimits()
        self._allowed = checks.Allowed(arm, limits.speed_m_s, limits.acceleration_m_s2)
        tool = any(arm.tool_m)
        self._workspace = Workspace(arm) if arm.n_sections == 1 and not tool else None
        self._passed: ShapeTarget | None = None

    def target(self, message: pb.Target) -> Target:
        """Check one message."""
        law, name = _law(message.law), message.WhichOneof("target")
        if name is None:
            raise TargetRejected(f"the message holds no target; one of {', '.join(KINDS)}")
        target = KINDS[name].checked(plain(getattr(message, name)), self._allowed, law)
        if isinstance(target, ShapeTarget) and not same(target, self._passed):
            self._check_reach(target)  # once: the same shape comes again and again
            target.check_motion(self._allowed)
            self._passed = target
        return target

    def _check_reach(self, shape: ShapeTarget) -> None:
        """Refuse a shape with a point out of reach: which one, and the nearest that is not."""
        if self._workspace is None:
            return
        names, points = zip(*shape.marks(), strict=True)
        outside = np.flatnonzero(~self._workspace.contains(np.array(points)))
        if len(outside):
            first = int(outside[0])
            answer = self._workspace.is_reachable(points[first])
            raise TargetRejected(
                f"{names[first]} at {_mm(points[first])} is out of reach; the nearest reachable "
                f"point is {_mm(answer.nearest_m)}, {1e3 * answer.distance_m:.1f} mm away"
            )

    def tip_pose(self, message: PoseInFrame) -> tuple[Array, Array]:
        """Check a measured marker pose; return the tip's position (3,) and quaternion (4,).

        Both are in the base frame; the position is the tool point's.
        """
        pose = checks.required(plain(message), "pose")
        rotation = rotation_from_quaternion(checks.quaternion(pose, "orientation"))
        marker = Transform(rotation, checks.vector(pose, "position"))
        try:
            tool = self._mountings.tool_pose(marker, message.frame_id)
        except InvalidInput as error:
            raise TargetRejected(str(error)) from error
        self._allowed.check_near(tool.position_m)
        return tool.position_m, quaternion_from_rotation(tool.rotation)


def plain(message: Message) -> dict[str, Any]:
    """Return the fields of a message as plain values, None for a message in it that is left out."""
    return {field.name: _value(message, field) for field in message.DESCRIPTOR.fields}


def _value(message: Message, field: Any) -> Any:
    value = getattr(message, field.name)
    if field.message_type is None:
        return list(value) if field.is_repeated else value
    if field.is_repeated:
        return [plain(each) for each in value]
    return plain(value) if message.HasField(field.name) else None


def _law(number: int) -> LawName:
    try:
        return LawName(number)
    except ValueError:
        raise TargetRejected(
            f"law = {number}; allowed: 0 (the configured one), 1 (resolved rate), 2 (QP)"
        ) from None


def _mm(point: Array) -> str:
    return "(" + ", ".join(f"{1e3 * value:.1f}" for value in point) + ") mm"

"""The arm as points in the base frame, so that any MCAP viewer draws it without code of ours.

Backbone and chambers from the estimated lengths; the tip frame and the target as three short
axes (x red, y green, z blue). Frames alone are shown by some viewers only when asked to.
"""

import numpy as np
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from pneuarm.controllers.arm.arm import CHAMBER_ANGLES_RAD, Arm, Array
from pneuarm.controllers.geometry.rotations import rotation_from_quaternion
from pneuarm.controllers.kinematics.constant_curvature import curve_transforms
from pneuarm.logs.foxglove.frames import BASE, timestamp

_POINT = np.dtype(
    [(axis, "<f4") for axis in ("x", "y", "z")]
    + [(color, "u1") for color in ("red", "green", "blue", "alpha")]
)
_FIELD_TYPES = {"<f4": PackedElementField.FLOAT32, "|u1": PackedElementField.UINT8}
_POINTS_PER_SECTION = 40
_AXIS_M = np.linspace(0.0, 0.03, 24)

_GREY = (150, 150, 150)
_CHAMBER_COLORS = ((230, 160, 50), (60, 180, 110), (150, 110, 220))
_AXIS_COLORS = ((240, 60, 60), (60, 220, 60), (80, 120, 255))


def _points(positions_m: Array, color: tuple[int, int, int]) -> np.ndarray:
    points = np.zeros(len(positions_m), dtype=_POINT)
    for index, axis in enumerate("xyz"):
        points[axis] = positions_m[:, index]
    points["red"], points["green"], points["blue"] = color
    points["alpha"] = 255
    return points


def _axes(position_m: Array, rotation: Array) -> list[np.ndarray]:
    return [
        _points(position_m + _AXIS_M[:, None] * rotation[:, index], _AXIS_COLORS[index])
        for index in range(3)
    ]


def body_points(arm: Arm, tick: np.void | np.ndarray) -> PointCloud:
    """Points of the arm as it is estimated to lie, with its tip frame and its target."""
    frames = curve_transforms(arm, tick["length_estimated_m"], _POINTS_PER_SECTION)
    clouds = [_points(frames[:, :3, 3], _GREY)]
    offsets = np.repeat(arm.per_section("chamber_offset_m"), _POINTS_PER_SECTION)
    offsets = np.concatenate([offsets[:1], offsets])
    for angle, color in zip(CHAMBER_ANGLES_RAD, _CHAMBER_COLORS, strict=True):
        direction = frames[:, :3, 0] * np.cos(angle) + frames[:, :3, 1] * np.sin(angle)
        clouds.append(_points(frames[:, :3, 3] + offsets[:, None] * direction, color))
    clouds += _axes(frames[-1, :3, 3], frames[-1, :3, :3])
    target = tick["target_position_m"]
    if np.isfinite(target).all():
        quaternion = tick["target_orientation_xyzw"]
        known = np.isfinite(quaternion).all()
        clouds += _axes(target, rotation_from_quaternion(quaternion) if known else np.eye(3))
    return _cloud(np.concatenate(clouds), tick["time_unix_ns"].item())


def _cloud(points: np.ndarray, time_unix_ns: int) -> PointCloud:
    return PointCloud(
        timestamp=timestamp(time_unix_ns),
        frame_id=BASE,
        pose=Pose(position=Vector3(), orientation=Quaternion(w=1.0)),
        point_stride=_POINT.itemsize,
        fields=[
            PackedElementField(
                name=name,
                offset=_POINT.fields[name][1] if _POINT.fields else 0,
                type=_FIELD_TYPES[_POINT[name].str],
            )
            for name in _POINT.names or ()
        ],
        data=points.tobytes(),
    )

"""Foxglove's well-known messages made from a tick: what any viewer shows as 3D."""

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp

BASE = "base"
_IDENTITY = (0.0, 0.0, 0.0, 1.0)


def timestamp(time_unix_ns: int) -> Timestamp:
    """Protobuf's time of a UTC time in nanoseconds."""
    seconds, nanos = divmod(time_unix_ns, 1_000_000_000)
    return Timestamp(seconds=seconds, nanos=nanos)


def tip_pose(tick: np.void | np.ndarray) -> PoseInFrame:
    """Estimated tip pose in the base frame."""
    x, y, z = tick["tip_estimated_position_m"].tolist()
    qx, qy, qz, qw = tick["tip_estimated_orientation_xyzw"].tolist()
    return PoseInFrame(
        timestamp=timestamp(tick["time_unix_ns"].item()),
        frame_id=BASE,
        pose=Pose(position=Vector3(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw)),
    )


def frame_transforms(tick: np.void | np.ndarray) -> FrameTransforms:
    """Frames below the base: tip, and where known target, tip_true and tip_measured."""
    time = timestamp(tick["time_unix_ns"].item())
    transforms = []
    for child, prefix in (
        ("tip", "tip_estimated"),
        ("target", "target"),
        ("tip_true", "tip_true"),
        ("tip_measured", "tip_measured"),
    ):
        x, y, z = tick[f"{prefix}_position_m"].tolist()
        if x != x:
            continue  # NaN: not known
        quaternion = tick[f"{prefix}_orientation_xyzw"].tolist()
        qx, qy, qz, qw = quaternion if quaternion[0] == quaternion[0] else _IDENTITY
        transforms.append(
            FrameTransform(
                timestamp=time,
                parent_frame_id=BASE,
                child_frame_id=child,
                translation=Vector3(x=x, y=y, z=z),
                rotation=Quaternion(x=qx, y=qy, z=qz, w=qw),
            )
        )
    return FrameTransforms(transforms=transforms)

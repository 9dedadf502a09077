"""The simulated motion capture: a marker, seen in the frame that the daemon is told of."""

import numpy as np
import pytest
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.geometry.mountings import Mountings
from pneuarm.controllers.geometry.rotations import rotation_from_quaternion
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.configuration import load
from pneuarm.service.configuration.tables.frames import FramesConfig
from pneuarm.service.emulators.camera import Camera
from pneuarm.service.wire.target_checks import TargetChecker

TOOL = {"tool_position_mm": (5.0, 0.0, 40.0)}
MARKER = {
    "tip_in_marker_position_mm": (0.0, 12.0, -3.0),
    "tip_in_marker_rotation_deg": (0.0, 0.0, 90.0),
}
MOCAP = {
    "mocap_frame": "lab",
    "mocap_position_mm": (1500.0, -700.0, 900.0),
    "mocap_rotation_deg": (0.0, 120.0, 0.0),
}


def state() -> pb.ArmState:
    quaternion = np.array([0.1, -0.2, 0.3, 0.9])
    return pb.ArmState(
        time_unix_ns=5_000_000_007,
        tip_true_position_m=[0.03, -0.02, 0.21],
        tip_true_orientation_xyzw=(quaternion / np.linalg.norm(quaternion)).tolist(),
    )


def picture(frames: Mountings) -> PoseInFrame:
    camera = Camera(100.0, 0.01, 0.0, 0, frames)
    camera.see(state(), 1.0)
    assert camera.due(1.009) is None
    pose = camera.due(1.011)
    assert pose is not None
    return pose


@pytest.mark.parametrize(
    "tables",
    [{}, TOOL, TOOL | MARKER, TOOL | MARKER | MOCAP],
    ids=["bare", "tool", "marker", "lab"],
)
def test_the_daemon_makes_the_true_tool_point_of_what_the_camera_sees(
    tables: dict[str, object],
) -> None:
    frames = FramesConfig.model_validate(tables).frames()
    pose = picture(frames)
    assert pose.frame_id == (frames.mocap_frame or "base")
    assert pose.timestamp.ToNanoseconds() == state().time_unix_ns
    position, quaternion = TargetChecker(load().build_arm(), frames).tip_pose(pose)
    np.testing.assert_allclose(position, state().tip_true_position_m, atol=1e-12)
    np.testing.assert_allclose(quaternion, state().tip_true_orientation_xyzw, atol=1e-12)


def test_without_a_marker_the_camera_sees_the_tip_that_carries_the_tool() -> None:
    seen = picture(FramesConfig.model_validate(TOOL).frames()).pose.position
    rotation = rotation_from_quaternion(np.array(state().tip_true_orientation_xyzw))
    tip = np.array(state().tip_true_position_m) - rotation @ [0.005, 0.0, 0.04]
    np.testing.assert_allclose([seen.x, seen.y, seen.z], tip, atol=1e-12)


def test_an_arm_that_is_not_simulated_has_no_tip_to_look_at() -> None:
    with pytest.raises(InvalidInput, match="not simulated"):
        Camera(100.0, 0.01, 0.0, 0, Mountings()).see(pb.ArmState(), 0.0)

"""`pneuarm emulate camera`: publishes what motion capture would measure of a simulated arm.

It reads the true tip from `state`, waits, adds noise, and publishes the pose of the marker in the
frame of motion capture, both as the daemon's `[frames]` have them: in the base where no such frame
is configured.
"""

import argparse
import contextlib
import time
from collections import deque
from dataclasses import replace

import numpy as np
import zenoh
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf.message import DecodeError

from pneuarm.controllers.arm.errors import DaemonUnreachable, InvalidInput
from pneuarm.controllers.geometry.mountings import Mountings, Transform
from pneuarm.controllers.geometry.rotations import (
    quaternion_from_rotation,
    rotation_from_quaternion,
)
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import encoding_of
from pneuarm.logs.schema.topics import STATE, TIP_POSE, full_key
from pneuarm.service.client.client import Client
from pneuarm.service.configuration.configuration import Configuration, recorded
from pneuarm.service.network import sessions as network
from pneuarm.service.wire.tip_pose_source import read_key, signature

#: Without a state for so long (s) there is no daemon.
_PATIENCE_S = 3.0
_POLL_S = 0.0005


class Camera:
    """Poses of the marker: ``delay_s`` late, with noise; at most ``rate_hz`` a second."""

    def __init__(
        self, rate_hz: float, delay_s: float, noise_m: float, seed: int, frames: Mountings
    ) -> None:
        self._period_s, self._delay_s, self._noise_m = 1.0 / rate_hz, delay_s, noise_m
        self._rng = np.random.default_rng(seed)
        self._frame_id = frames.mocap_frame or "base"
        self._frames = frames if frames.mocap_frame else replace(frames, mocap_to_base=Transform())
        self._next_s = 0.0
        self._waiting: deque[tuple[float, PoseInFrame]] = deque()

    def see(self, state: pb.ArmState, now_s: float) -> None:
        """Take a picture of a state when it is time for one.

        Raises InvalidInput for an arm that is not simulated: nobody knows its true tip.
        """
        if len(state.tip_true_position_m) != 3:
            raise InvalidInput(
                "the daemon's arm is not simulated: its states hold no true tip to look at"
            )
        if now_s < self._next_s:
            return
        self._next_s = max(self._next_s + self._period_s, now_s - self._period_s)
        self._waiting.append((now_s + self._delay_s, self._picture(state)))

    def _picture(self, state: pb.ArmState) -> PoseInFrame:
        """Pose of the marker; the true tip of a state is the tool point's."""
        true = Transform(
            rotation_from_quaternion(np.array(state.tip_true_orientation_xyzw)),
            np.array(state.tip_true_position_m),
        )
        tool = Transform(position_m=np.array(self._frames.tool_m))
        marker = self._frames.marker_pose(true @ tool.inverse())
        position = marker.position_m + self._rng.normal(0.0, self._noise_m, 3)
        pose = PoseInFrame(frame_id=self._frame_id)
        pose.timestamp.FromNanoseconds(state.time_unix_ns)
        for axis, value in zip("xyz", position.tolist(), strict=True):
            setattr(pose.pose.position, axis, value)
        quaternion = quaternion_from_rotation(marker.rotation)
        for axis, value in zip("xyzw", quaternion.tolist(), strict=True):
            setattr(pose.pose.orientation, axis, value)
        return pose

    def due(self, now_s: float) -> PoseInFrame | None:
        """Return the next pose whose time has come."""
        if self._waiting and self._waiting[0][0] <= now_s:
            return self._waiting.popleft()[1]
        return None


def emulate_camera(arguments: argparse.Namespace) -> int:
    """Publish until Ctrl-C, or for some seconds."""
    delay_s, noise_m = 1e-3 * arguments.delay_ms, 1e-3 * arguments.noise_mm
    configuration = _configuration(arguments)
    frames, feedback = configuration.frames.frames(), configuration.feedback
    camera = Camera(arguments.rate, delay_s, noise_m, arguments.seed, frames)
    key = full_key(arguments.arm, f"{TIP_POSE.key}/{feedback.tip_pose_source or 'camera'}")
    secret = read_key(feedback)
    session = network.open_connected(arguments.connect)
    try:
        count = _publish(session, camera, arguments, key, secret)
    finally:
        session.close()
    print(f"{count} poses published")
    return 0


def _configuration(arguments: argparse.Namespace) -> Configuration:
    """Ask the daemon where motion capture, marker and tool are, and under which name to publish."""
    with Client(arguments.arm, arguments.connect, "camera") as client:
        return recorded(client.info().config_toml, "the daemon")


def _publish(
    session: "zenoh.Session",
    camera: Camera,
    arguments: argparse.Namespace,
    key: str,
    secret: bytes,
) -> int:
    states = session.declare_subscriber(
        full_key(arguments.arm, STATE.key), zenoh.handlers.RingChannel(1)
    )
    poses = session.declare_publisher(
        key,
        encoding=encoding_of(PoseInFrame()),
        congestion_control=zenoh.CongestionControl.DROP,
        express=True,
    )
    begun_s = heard_s = time.monotonic()
    count = 0
    while not arguments.seconds or time.monotonic() - begun_s < arguments.seconds:
        now_s = time.monotonic()
        sample = states.try_recv()
        if sample is not None:
            heard_s = now_s
            with contextlib.suppress(DecodeError):  # no state: not the daemon's
                camera.see(pb.ArmState.FromString(sample.payload.to_bytes()), now_s)
        elif now_s - heard_s > _PATIENCE_S:
            raise DaemonUnreachable(
                f"no state of arm {arguments.arm!r} under {arguments.connect} for {_PATIENCE_S:g} "
                "s; start the daemon with `pneuarm run`, or name the arm with --arm"
            )
        while (pose := camera.due(now_s)) is not None:
            payload = pose.SerializeToString()
            poses.put(payload, attachment=signature(secret, payload) if secret else None)
            count += 1
        time.sleep(_POLL_S)
    return count

"""What clients stream in: targets and measured tip poses, checked before they go to control."""

import time
from dataclasses import replace

import numpy as np
import zenoh
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import MessageRejected, TargetRejected
from pneuarm.controllers.limits.limits import names, workspace_is_exact
from pneuarm.controllers.targets.targets import PositionTarget, Target
from pneuarm.controllers.workspace.reachability import Reachability
from pneuarm.controllers.workspace.workspace import Workspace
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import decode
from pneuarm.logs.schema.topics import TARGET, TIP_POSE
from pneuarm.service.processes.pipe import Pipe, SetTarget, SetTipPose
from pneuarm.service.processes.shared import Shared
from pneuarm.service.wire.gateway_events import Notes
from pneuarm.service.wire.lease import Lease
from pneuarm.service.wire.publisher import Publisher
from pneuarm.service.wire.target_checks import TargetChecker
from pneuarm.service.wire.tip_pose_source import PosePublisher

#: A client may have seen states that this process has not read from the ring yet.
_AHEAD_TICKS = 1000

#: For a moving target out of reach the nearest point is searched this often at most.
_SEARCH_EVERY_NS = 100_000_000


class Inbox:
    """Callbacks of the two streams; what they refuse becomes an event that says why."""

    def __init__(
        self, shared: Shared, stream: Pipe, lease: Lease, publisher: Publisher, notes: Notes
    ) -> None:
        control = shared.configuration.control
        self._stream, self._lease, self._publisher, self._notes = stream, lease, publisher, notes
        configuration = shared.configuration
        arm, frames = configuration.build_arm(), configuration.frames.frames()
        self._checker = TargetChecker(arm, frames, configuration.reference.limits())
        self._publisher_of_poses = PosePublisher()
        # With keep-outs the workspace has holes that it does not know; of a tool it knows nothing.
        known = workspace_is_exact(arm)
        self._workspace = Workspace(arm) if known else None
        self._out_of_reach = False
        self._nearest: tuple[Array, Reachability] | None = None
        self._searched_ns = 0
        self._rate_hz = control.rate_hz
        self._stale_s = control.target_timeout_ms * 1e-3

    def on_target(self, sample: zenoh.Sample) -> None:
        """Take a target from who holds the lease."""
        received_ns = time.monotonic_ns()
        payload = sample.payload.to_bytes()
        message = pb.Target()
        try:
            message = decode(pb.Target, payload, str(sample.encoding))
            target = self._checker.target(message)
            with self._notes.lock:
                self._check_fresh(message.state_sequence)
                self._lease.check_target(
                    message.client_id, message.lease_secret, message.sequence, received_ns * 1e-9
                )
                self._check_active()
            told = self._towards_nearest(target, message.client_id, received_ns)
            self._stream.send(SetTarget(told, message.sequence, received_ns))
        except MessageRejected as error:
            self._notes.reject(TARGET.key, str(error), message.client_id, payload, message.sequence)
            return
        message.lease_secret = ""  # the log is no place for it
        self._notes.log(TARGET, message, received_ns)

    def _towards_nearest(self, target: Target, client: str, now_ns: int) -> Target:
        """Add the lengths of the nearest reachable point to a position out of reach; tell it once.

        Only for one section, where the workspace is known exactly. Finding the nearest point takes
        milliseconds, too long for a tick and for every target of a stream: a moving target has to
        do without between two searches, and goes as near as a straight way leads.
        """
        if self._workspace is None or not isinstance(target, PositionTarget):
            return target
        if bool(self._workspace.contains(target.position_m)):
            self._out_of_reach = False
            return target
        if self._nearest is None or not np.array_equal(self._nearest[0], target.position_m):
            if self._out_of_reach and now_ns - self._searched_ns < _SEARCH_EVERY_NS:
                return target
            self._nearest = target.position_m, self._workspace.is_reachable(target.position_m)
            self._searched_ns = now_ns
        answer = self._nearest[1]
        if not self._out_of_reach:
            self._tell_out_of_reach(answer, client)
        self._out_of_reach = True
        lengths = self._workspace.lengths_m(answer.nearest_m)
        return replace(target, nearest_lengths_m=lengths)

    def _tell_out_of_reach(self, answer: Reachability, client: str) -> None:
        binding = " and ".join(names(answer.limits))
        nearest = ", ".join(f"{1e3 * value:.1f}" for value in answer.nearest_m)
        self._notes.tell(
            "out_of_reach",
            f"the target is out of reach: {binding} binds; the nearest reachable point is "
            f"({nearest}) mm, {1e3 * answer.distance_m:.1f} mm away",
            client,
        )

    def _check_fresh(self, state_sequence: int) -> None:
        newest = self._publisher.newest_sequence
        age_s = (newest - state_sequence) / self._rate_hz
        if state_sequence > newest + _AHEAD_TICKS:
            raise TargetRejected(
                f"state_sequence = {state_sequence}, but the arm is only at {newest}; repeat the "
                "number of the newest `state` that was received"
            )
        if age_s > self._stale_s:
            raise TargetRejected(
                f"state_sequence = {state_sequence} while the arm is at {newest}: the sender has "
                f"not seen a state for {age_s:.3g} s (allowed: {self._stale_s:g} s); its network "
                "is stalled, or it does not read `state`"
            )

    def _check_active(self) -> None:
        mode = self._publisher.newest_mode
        if mode != pb.ACTIVE:
            raise TargetRejected(
                f"the arm is in mode {pb.Mode.Name(mode).lower()} and follows no target; enable it"
            )

    def on_tip_pose(self, sample: zenoh.Sample) -> None:
        """Take a tip pose that motion capture has measured."""
        received_ns = time.monotonic_ns()
        payload = sample.payload.to_bytes()
        try:
            message = decode(PoseInFrame, payload, str(sample.encoding))
            self._publisher_of_poses.check(sample, message, received_ns * 1e-9)
            position, quaternion = self._checker.tip_pose(message)
        except MessageRejected as error:
            self._notes.reject(TIP_POSE.key, str(error), "", payload)
            return
        self._stream.send(SetTipPose(position, quaternion, received_ns))
        self._notes.log(TIP_POSE, message, received_ns)

"""What clients stream in: targets and measured tip poses, checked before they go to control.

The cheapest check comes first, and who holds the lease before what it asks for. All who do not
hold it share one allowance of computing time, the holder has one of its own.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import zenoh
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import MessageRejected, TargetRejected
from pneuarm.controllers.limits.limits import words, workspace_is_exact
from pneuarm.controllers.targets.same import is_near
from pneuarm.controllers.targets.targets import PositionTarget, Target
from pneuarm.controllers.workspace.reachability import Reachability
from pneuarm.controllers.workspace.workspace import Workspace
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import decode
from pneuarm.logs.schema.topics import TARGET, TIP_POSE, full_key
from pneuarm.service.processes.pipe import Pipe, SetTarget, SetTipPose
from pneuarm.service.processes.shared import Shared
from pneuarm.service.wire.allowance import Allowance
from pneuarm.service.wire.gateway_events import Notes
from pneuarm.service.wire.lease import Lease
from pneuarm.service.wire.mailbox import last_resort, serve
from pneuarm.service.wire.publisher import Publisher
from pneuarm.service.wire.target_checks import TargetChecker
from pneuarm.service.wire.tip_pose_source import TipPoseSource, read_key, source_of

#: A client may have seen states that this process has not read from the ring yet.
_AHEAD_TICKS = 1000

#: For a moving target out of reach the nearest point is searched this often at most.
_SEARCH_EVERY_NS = 100_000_000

#: Share of one core that messages may cost: those of the lease's holder, of motion capture, and of
#: all others together.
_HOLDERS_SHARE, _POSES_SHARE, _STRANGERS_SHARE = 0.6, 0.3, 0.1

#: What waits to be read, at most; the newest are kept.
_WAITING = 64


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
        feedback = configuration.feedback
        self._source = TipPoseSource(
            feedback.tip_pose_source, read_key(feedback), 1e-3 * feedback.camera_timeout_ms
        )
        self._told_open = False
        self._holders = Allowance(_HOLDERS_SHARE)
        self._poses = Allowance(_POSES_SHARE)
        self._strangers = Allowance(_STRANGERS_SHARE)
        # With keep-outs the workspace has holes that it does not know; of a tool it knows nothing.
        known = workspace_is_exact(arm)
        self._workspace = Workspace(arm) if known else None
        self._out_of_reach = False
        self._nearest: tuple[Array, Reachability] | None = None
        self._searched_ns = 0
        self._rate_hz = control.rate_hz
        self._stale_s = control.target_timeout_ms * 1e-3

    def listen(self, session: zenoh.Session, arm_name: str) -> list[object]:
        """Subscribe; command keys are plain subscriptions, never cached for late joiners."""

        def subscribe(key: str, work: Callable[[zenoh.Sample], None]) -> object:
            declare = partial(session.declare_subscriber, full_key(arm_name, key))
            return serve(declare, last_resort(work, partial(self._refuse, key)), _WAITING)

        subscribed = [
            subscribe(TARGET.key, self.on_target),
            subscribe(f"{TIP_POSE.key}/**", self.on_tip_pose),
        ]
        if self._source.name:  # others crowd nothing out of what waits under the one that counts
            believed = f"{TIP_POSE.key}/{self._source.name}"
            subscribed.append(subscribe(believed, self._on_believed_pose))
        return subscribed

    def _refuse(self, key: str, sample: zenoh.Sample, why: str) -> None:
        self._notes.reject(key, why, payload=sample.payload.to_bytes())

    def on_target(self, sample: zenoh.Sample) -> None:
        """Take a target from who holds the lease."""
        received_ns = time.monotonic_ns()
        payload = sample.payload.to_bytes()
        holder = self._lease.is_proved_by(payload)
        allowance = self._holders if holder else self._strangers
        now_s, message = received_ns * 1e-9, pb.Target()
        if allowance.left(now_s) <= 0.0:
            self._notes.skip(TARGET.key)
            return
        begun_s = time.thread_time()
        try:
            message = decode(pb.Target, payload, str(sample.encoding))
            self._take_target(message, received_ns)
        except MessageRejected as error:
            who, number = message.client_id, message.sequence
            self._notes.reject(TARGET.key, str(error), who, payload, number, holder=holder)
        finally:
            allowance.spend(time.thread_time() - begun_s, now_s)

    def _take_target(self, message: pb.Target, received_ns: int) -> None:
        """Check who sends it, then what it is; raises TargetRejected before anything changes."""
        claim = (message.client_id, message.lease_secret, message.sequence)
        with self._notes.lock:
            self._lease.check_target(*claim)
        self._check_fresh(message.state_sequence)
        self._check_active()
        target = self._checker.target(message)
        with self._notes.lock:  # it may have changed hands meanwhile
            self._lease.take_target(*claim, received_ns * 1e-9)
        told = self._towards_nearest(target, message.client_id, received_ns)
        self._stream.send(SetTarget(told, message.sequence, received_ns))
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
        if self._nearest is None or not is_near(self._nearest[0], target.position_m):
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
        nearest = ", ".join(f"{1e3 * value:.1f}" for value in answer.nearest_m)
        self._notes.tell(
            "out_of_reach",
            f"the target is out of reach: {words(answer.limits)} binds; the nearest "
            f"reachable point is ({nearest}) mm, {1e3 * answer.distance_m:.1f} mm away",
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
        """Take a tip pose that motion capture has measured, where no source is configured."""
        source = source_of(str(sample.key_expr))
        if not self._source.name:
            self._take_pose(sample, source, self._poses)
        elif source != self._source.name:
            self._take_pose(sample, source, self._strangers)

    def _on_believed_pose(self, sample: zenoh.Sample) -> None:
        self._take_pose(sample, self._source.name, self._poses)

    def _take_pose(self, sample: zenoh.Sample, source: str, allowance: Allowance) -> None:
        received_ns = time.monotonic_ns()
        now_s = received_ns * 1e-9
        if allowance.left(now_s) <= 0.0:
            self._notes.skip(TIP_POSE.key)
            return
        payload, begun_s = sample.payload.to_bytes(), time.thread_time()
        try:
            self._check_pose(sample, payload, source, received_ns)
        except MessageRejected as error:
            self._notes.reject(TIP_POSE.key, str(error), source, payload)
        finally:
            allowance.spend(time.thread_time() - begun_s, now_s)

    def _check_pose(
        self, sample: zenoh.Sample, payload: bytes, source: str, received_ns: int
    ) -> None:
        """Take a pose; raises TargetRejected for who sends it, or for what it is."""
        now_s = received_ns * 1e-9
        attachment = b"" if sample.attachment is None else sample.attachment.to_bytes()
        source = source or _session_of(sample)
        self._source.check_publisher(source, payload, attachment, now_s)
        message = decode(PoseInFrame, payload, str(sample.encoding))
        position, quaternion = self._checker.tip_pose(message)
        self._source.take(source, message, now_s)
        self._stream.send(SetTipPose(position, quaternion, received_ns))
        self._notes.log(TIP_POSE, message, received_ns)
        if self._source.is_open and not self._told_open:
            self._told_open = True
            self._notes.tell(
                "tip_pose_open",
                "the measured tip comes from whoever publishes it: anyone on this wire can move an "
                "active arm by it; name the publisher with feedback.tip_pose_source",
                source,
            )


def _session_of(sample: zenoh.Sample) -> str:
    """Return who publishes under the key without a name, where that is told: few publishers do."""
    info = sample.source_info
    who = None if info is None else info.source_id
    return "" if who is None else f"{who.zid}/{who.eid}"

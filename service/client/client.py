"""The client: what a user's own program talks to the daemon with.

It loads no solver, no Rerun and no MCAP. Nothing is sent from a background thread: a program that
hangs stops refreshing its target, and the arm holds.
"""

import contextlib
import socket
import time
import uuid
from collections.abc import Iterator
from types import TracebackType
from typing import Any, TypeVar

import zenoh
from google.protobuf.message import DecodeError, Message

from pneuarm.controllers.arm.errors import (
    DaemonUnreachable,
    LeaseRefused,
    MessageRejected,
    ModeRefused,
    MoveTimeout,
    NotConfirmed,
    PneuarmError,
    TargetRejected,
)
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import decode, encoding_of
from pneuarm.logs.schema.topics import (
    ALIVE_CLIENT,
    ESTOP,
    EVENT,
    INFO,
    MODE,
    STATE,
    TARGET,
    Topic,
    full_key,
)
from pneuarm.service.client.target_messages import (
    Vector,
    pose_target,
    position_target,
    twist_target,
)
from pneuarm.service.network import sessions as network

_QUERY_S = 2.0
_REFRESH_S = 0.02

#: A stop is sent before everything else, and waits for room rather than being dropped.
_URGENT: dict[str, Any] = {
    "priority": zenoh.Priority.REAL_TIME,
    "congestion_control": zenoh.CongestionControl.BLOCK,
    "express": True,
}

_REFUSALS: dict[int, type[PneuarmError]] = {
    pb.BAD_REQUEST: MessageRejected,
    pb.LEASE_REFUSED: LeaseRefused,
}

M = TypeVar("M", bound=Message)


class Client:
    """One connection to the daemon of one arm; a context manager.

    Positions are in metres in the base frame, pressures in pascal (gauge), lengths in metres.
    Raises DaemonUnreachable if nobody answers under ``connect``.
    """

    def __init__(
        self,
        arm: str = "paper",
        connect: str = network.DEFAULT_ENDPOINT,
        name: str = "",
        zenoh_config_file: str = "",
    ) -> None:
        self.arm = arm
        self.client_id = f"{name or 'client'}@{socket.gethostname()}-{uuid.uuid4().hex[:6]}"
        self._session = network.open_connected(connect, zenoh_config_file)
        self._secret = ""
        self._sequence = 0
        self._newest: pb.ArmState | None = None
        self._received_s = 0.0
        self._declare(connect)

    def _declare(self, connect: str) -> None:
        session = self._session
        alive = full_key(self.arm, f"{ALIVE_CLIENT}/{self.client_id}")
        self._token = session.liveliness().declare_token(alive)
        # A ring of one: always the newest state, never a queue of old ones.
        self._states = session.declare_subscriber(self._key(STATE), zenoh.handlers.RingChannel(1))
        self._events = session.declare_subscriber(self._key(EVENT), zenoh.handlers.RingChannel(256))
        self._targets = session.declare_publisher(
            self._key(TARGET),
            encoding=encoding_of(pb.Target()),
            congestion_control=zenoh.CongestionControl.DROP,
            express=True,
        )
        try:
            self.state()
        except DaemonUnreachable:
            self.close()
            raise DaemonUnreachable(
                f"a daemon listens at {connect}, but none for arm {self.arm!r}; name the arm with "
                "--arm, or start it with `pneuarm run`"
            ) from None

    def _key(self, topic: Topic) -> str:
        return full_key(self.arm, topic.key)

    def __enter__(self) -> "Client":
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close: the arm holds where it is."""
        self.close()

    def close(self) -> None:
        """Give the lease back, if this client has it, and close the connection."""
        if self._session.is_closed():
            return
        with contextlib.suppress(PneuarmError):
            if self._secret:
                self.release()
        self._session.close()

    # --- what the arm does -----------------------------------------------------------------

    def state(self, timeout_s: float = 2.0) -> pb.ArmState:
        """Return the newest state; raises DaemonUnreachable if none comes in time."""
        waited_until = time.monotonic() + timeout_s
        while True:
            sample = self._states.try_recv()
            if sample is not None and self._take(sample):
                continue
            if self._newest is not None and self._fresh():
                return self._newest
            elif time.monotonic() > waited_until:
                raise DaemonUnreachable(f"no state of arm {self.arm!r} for {timeout_s:g} s")
            else:
                time.sleep(0.001)

    def _take(self, sample: zenoh.Sample) -> bool:
        """Keep a state; what is none was published by somebody else, and is passed over."""
        try:
            self._newest = pb.ArmState.FromString(sample.payload.to_bytes())
        except DecodeError:
            return False
        self._received_s = time.monotonic()
        return True

    def _fresh(self) -> bool:
        return time.monotonic() - self._received_s < 0.1

    def states(self) -> Iterator[pb.ArmState]:
        """Yield every new state as it comes, at most 100 a second; never a stale one."""
        last = 0
        while True:
            state = self.state()
            if state.sequence != last:
                last = state.sequence
                yield state
            time.sleep(0.002)

    def events(self) -> list[pb.Event]:
        """Return the events since the last call."""
        found = []
        while (sample := self._events.try_recv()) is not None:
            with contextlib.suppress(MessageRejected):  # no event: not the daemon's
                found.append(decode(pb.Event, sample.payload.to_bytes(), str(sample.encoding)))
        return found

    def info(self) -> pb.Info:
        """Return configuration, limits and versions of the daemon."""
        return self._query(INFO, pb.ModeRequest(), pb.Info())

    def _query(self, topic: Topic, request: Message, answer: M) -> M:
        replies = self._session.get(
            self._key(topic),
            payload=request.SerializeToString(),
            encoding=encoding_of(request),
            timeout=_QUERY_S,
        )
        for reply in replies:
            if reply.ok is not None:
                return decode(type(answer), reply.ok.payload.to_bytes(), str(reply.ok.encoding))
        raise DaemonUnreachable(f"the daemon of arm {self.arm!r} does not answer")

    # --- modes -----------------------------------------------------------------------------

    def _mode(self, action: "pb.Action", take_over: bool = False) -> pb.Reply:
        request = pb.ModeRequest(
            client_id=self.client_id,
            lease_secret=self._secret,
            action=action,
            take_over=take_over,
        )
        reply = self._query(MODE, request, pb.Reply())
        if reply.lease_secret:
            self._secret = reply.lease_secret
        if not reply.accepted:
            raise _REFUSALS.get(reply.refusal, ModeRefused)(reply.reason)
        self._wait_for(reply.state_sequence)
        return reply

    def _wait_for(self, sequence: int) -> None:
        """Wait until the states that arrive show what a reply has told."""
        waited_until = time.monotonic() + _QUERY_S
        while self.state().sequence < sequence and time.monotonic() < waited_until:
            time.sleep(0.002)

    def enable(self, take_over: bool = False, timeout_s: float = 3.0) -> pb.Reply:
        """Take the lease and arm; waits while the chambers are still venting.

        Raises LeaseRefused with the holder's name, or ModeRefused with the reason.
        """
        waited_until = time.monotonic() + timeout_s
        while self.state().mode == pb.IDLE and time.monotonic() < waited_until:
            time.sleep(0.02)
        return self._mode(pb.ENABLE, take_over)

    def take_lease(self, take_over: bool = False) -> pb.Reply:
        """Take the lease without arming."""
        return self._mode(pb.TAKE_LEASE, take_over)

    def hold(self) -> pb.Reply:
        """Hold; anybody may."""
        return self._mode(pb.HOLD_NOW)

    def vent(self) -> pb.Reply:
        """Vent, to idle; anybody may."""
        return self._mode(pb.VENT)

    def reset(self) -> pb.Reply:
        """Leave fault or estop, to idle."""
        return self._mode(pb.RESET)

    def release(self) -> pb.Reply:
        """Give the lease back; the arm holds."""
        reply = self._mode(pb.RELEASE_LEASE)
        self._secret = ""
        return reply

    def estop(self, timeout_s: float = 1.0) -> pb.ArmState:
        """Stop; return the state that shows it, or raise NotConfirmed."""
        self._session.put(self._key(ESTOP), b"estop", **_URGENT)
        waited_until = time.monotonic() + timeout_s
        with contextlib.suppress(DaemonUnreachable):
            while time.monotonic() < waited_until:
                state = self.state(timeout_s=0.2)
                if state.mode == pb.ESTOP:
                    return state
                time.sleep(0.002)
        raise NotConfirmed(
            f"NOT CONFIRMED: no state of arm {self.arm!r} shows the stop; cut the air supply"
        )

    # --- targets ---------------------------------------------------------------------------

    def send(self, target: pb.Target) -> int:
        """Send one target of any kind, once; return its sequence number.

        It must be sent again before the daemon's target timeout (200 ms), or the arm holds.
        """
        self._sequence += 1
        target.client_id = self.client_id
        target.lease_secret = self._secret
        target.sequence = self._sequence
        target.state_sequence = self.state().sequence
        self._targets.put(target.SerializeToString())
        return self._sequence

    def send_position(
        self,
        position_m: Vector,
        law: "pb.Law" = pb.DEFAULT,
        velocity_m_s: Vector | None = None,
    ) -> int:
        """Send a tip position (3,) in the base frame, m; in a stream also its velocity."""
        return self.send(position_target(position_m, law, velocity_m_s))

    def send_pose(
        self, position_m: Vector, quaternion_xyzw: Vector, law: "pb.Law" = pb.DEFAULT
    ) -> int:
        """Send a tip pose in the base frame: position (3,) m, unit quaternion (4,)."""
        return self.send(pose_target(position_m, quaternion_xyzw, law))

    def send_twist(
        self,
        linear_m_s: Vector,
        angular_rad_s: Vector | None = None,
        frame_id: str = "base",
        reference_point: str = "tip",
        law: "pb.Law" = pb.DEFAULT,
    ) -> int:
        """Send a tip twist: linear (3,) m/s, angular (3,) rad/s or None."""
        return self.send(twist_target(linear_m_s, angular_rad_s, frame_id, reference_point, law))

    def send_lengths(self, lengths_m: Vector) -> int:
        """Send chamber lengths, three a section, m."""
        return self.send(pb.Target(lengths=pb.LengthsTarget(length_m=lengths_m)))

    def send_pressures(self, pressures_pa: Vector) -> int:
        """Send chamber pressures, three a section, gauge, Pa."""
        return self.send(pb.Target(pressures=pb.PressuresTarget(pressure_pa=pressures_pa)))

    def move_to(self, position_m: Vector, timeout_s: float = 10.0) -> pb.ArmState:
        """Send a tip position again and again until it is reached; see wait_until_reached."""
        return self.wait_until_reached(position_target(position_m), timeout_s)

    def wait_until_reached(self, target: pb.Target, timeout_s: float = 10.0) -> pb.ArmState:
        """Refresh a target until the arm has reached it, and return the state that says so.

        A target out of reach ends the wait too: the state's ``reach`` tells, ``binding_limits``
        why. Raises TargetRejected, ModeRefused when the arm stops following, or MoveTimeout.
        """
        self.events()
        first = self.send(target)
        waited_until = time.monotonic() + timeout_s
        while time.monotonic() < waited_until:
            time.sleep(_REFRESH_S)
            state = self.state()
            self.raise_if_refused(first)
            if state.mode != pb.ACTIVE:
                mode = pb.Mode.Name(state.mode).lower()
                raise ModeRefused(f"the arm is in mode {mode} and follows no target; enable it")
            if state.target_sequence >= first and state.reach in (pb.REACHED, pb.OUT_OF_REACH):
                return state
            self.send(target)
        raise MoveTimeout(
            f"not reached within {timeout_s:g} s; the arm holds on its way there: give it longer"
        )

    def raise_if_refused(self, first: int = 0) -> None:
        """Raise TargetRejected if the daemon has refused a target of this client's.

        Targets before number ``first`` do not count: their refusals may come late.
        """
        for event in self.events():
            # A refused request was raised by its own call; its event may come after that.
            ours = event.client_id == self.client_id and event.key == TARGET.key
            if ours and event.code == "rejected" and event.target_sequence >= first:
                raise TargetRejected(event.text)

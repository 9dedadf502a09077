"""The client: what a user's own program talks to the daemon with.

It loads no solver, no Rerun and no MCAP. Nothing is sent from a background thread: a program that
hangs stops refreshing its target, and the arm holds.
"""

import contextlib
import os
import socket
import time
import uuid
from collections.abc import Iterator
from types import TracebackType
from typing import Any, TypeVar

import zenoh
from google.protobuf.message import DecodeError, Message

from pneuarm import __version__
from pneuarm.controllers.arm.errors import (
    DaemonUnreachable,
    LeaseRefused,
    MessageRejected,
    ModeRefused,
    NotConfirmed,
    PneuarmError,
)
from pneuarm.controllers.arm.names import check_arm_name
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import decode, encoding_of
from pneuarm.logs.schema.printable import printable
from pneuarm.logs.schema.topics import (
    ALIVE_CLIENT,
    ESTOP,
    EVENT,
    EVENTS,
    INFO,
    MODE,
    STATE,
    TARGET,
    Topic,
    full_key,
)
from pneuarm.service.client.moving import Moving
from pneuarm.service.network import sessions as network

_QUERY_S = 2.0

#: A stop that is not answered for so long is sent again.
_STOP_AGAIN_S = 0.25

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


def new_client_id(name: str = "") -> str:
    """Return a name for one client: its program, this machine, and a number, 64 characters at most.

    What no key or terminal takes becomes a dash.
    """
    parts = (name or "client")[:32], socket.gethostname()[:24]
    program, machine = (
        "".join(c if c.isprintable() and c not in "/*$?#" else "-" for c in part) for part in parts
    )
    return f"{program}@{machine}-{uuid.uuid4().hex[:6]}"


def _versions_apart(daemons: str) -> str:
    """Say so where daemon and client are of different versions."""
    if not daemons or daemons == __version__:
        return ""
    return f" (the daemon is pneuarm {printable(daemons, 32)}, this client {__version__})"


class Client(Moving):
    """One connection to the daemon of one arm; a context manager.

    Positions are in metres in the base frame, pressures in pascal (gauge), lengths in metres.
    Raises DaemonUnreachable if nobody answers under ``connect``, InvalidInput for what is no
    address or no arm's name.
    """

    def __init__(
        self,
        arm: str = "paper",
        connect: str = network.DEFAULT_ENDPOINT,
        name: str = "",
        zenoh_config_file: str = "",
    ) -> None:
        check_arm_name(arm)
        self.arm = arm
        self.client_id = new_client_id(name)
        self._process = os.getpid()
        self._session = network.open_connected(connect, zenoh_config_file)
        self._secret = ""
        self._sequence = 0
        self._newest: pb.ArmState | None = None
        self._received_s = 0.0
        with network.failing_in_words():
            self._declare()
        try:
            self.state()
        except DaemonUnreachable:
            self.close()
            raise DaemonUnreachable(
                f"a daemon listens at {connect}, but none for arm {self.arm!r}; name the arm with "
                "--arm, or start it with `pneuarm run`"
            ) from None

    def _declare(self) -> None:
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
        if os.getpid() != self._process or self._session.is_closed():
            return  # of a parent's session, a forked process holds no more than the memory
        with contextlib.suppress(PneuarmError):
            if self._secret:
                self.release()
        self._session.close()

    # --- what the arm does -----------------------------------------------------------------

    def state(self, timeout_s: float = 2.0) -> pb.ArmState:
        """Return the newest state; raises DaemonUnreachable if none comes in time."""
        self._check_process()
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
        self._check_process()
        found = []
        while (sample := self._events.try_recv()) is not None:
            with contextlib.suppress(MessageRejected):  # no event: not the daemon's
                payload, encoding = sample.payload.to_bytes(), str(sample.encoding)
                found.append(decode(pb.Event, payload, encoding, tolerant=True))
        return found

    def past_events(self) -> pb.Events:
        """Return what was told before this client came.

        ``recent`` are the newest events, oldest first; ``latched`` are those that led to the fault
        or the stop that is latched now, the cause first, empty where nothing is.
        """
        return self._query(EVENTS, pb.ModeRequest(), pb.Events())

    def info(self) -> pb.Info:
        """Return configuration, limits and versions of the daemon."""
        return self._query(INFO, pb.ModeRequest(), pb.Info())

    def _query(self, topic: Topic, request: Message, answer: M) -> M:
        payload, encoding = request.SerializeToString(), encoding_of(request)
        for found in self._ask(topic, payload, type(answer), _QUERY_S, encoding=encoding):
            return found
        raise DaemonUnreachable(
            f"the daemon of arm {self.arm!r} does not answer {topic.key}; where its Zenoh file has "
            "access control, this client's certificate may not be allowed to ask"
        )

    def _ask(
        self, topic: Topic, payload: bytes, answer: type[M], timeout_s: float, **options: Any
    ) -> Iterator[M]:
        """Yield the daemon's answers: what others answer under its key is passed over."""
        self._check_process()
        with network.failing_in_words():
            replies = self._session.get(
                self._key(topic),
                payload=payload,
                timeout=timeout_s,
                target=zenoh.QueryTarget.ALL,
                consolidation=zenoh.ConsolidationMode.NONE,
                **options,
            )
        for reply in replies:
            source = reply.replier_id
            zid = getattr(source, "zid", source)  # older versions of Zenoh return it itself
            if zid not in self._session.info.routers_zid():
                continue
            if reply.ok is None:
                raise DaemonUnreachable(printable(reply.err.payload.to_string()))
            encoding = str(reply.ok.encoding)
            yield decode(answer, reply.ok.payload.to_bytes(), encoding, tolerant=True)

    def _check_process(self) -> None:
        """Raise DaemonUnreachable in a process forked from this client's: it would hang there."""
        if os.getpid() != self._process:
            raise DaemonUnreachable(
                f"this client was opened by process {self._process}, and this is one forked from "
                "it; a Zenoh session does not survive a fork: open a Client here before any other, "
                'or start processes with multiprocessing.get_context("spawn")'
            )

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
            raise _REFUSALS.get(reply.refusal, ModeRefused)(
                printable(reply.reason) + _versions_apart(reply.version)
            )
        self._wait_for(reply.state_sequence)
        return reply

    def _wait_for(self, sequence: int) -> None:
        """Wait until the states that arrive show what a reply has told."""
        waited_until = time.monotonic() + _QUERY_S
        while self.state().sequence < sequence and time.monotonic() < waited_until:
            time.sleep(0.002)

    def enable(self, take_over: bool = False, timeout_s: float = 3.0) -> pb.Reply:
        """Take the lease and arm; waits while the chambers are still venting.

        Whose lease it is already may ask again. Raises LeaseRefused with the holder's name, or
        ModeRefused with the reason.
        """
        waited_until = time.monotonic() + timeout_s
        while self.state().mode == pb.IDLE and time.monotonic() < waited_until:
            time.sleep(0.02)
        if self._secret and self.state().mode == pb.ACTIVE:
            reply = self.take_lease(take_over)
            if reply.mode == pb.ACTIVE:
                return reply
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
        """Stop; return the state that shows it, or raise NotConfirmed.

        It is confirmed by the daemon's own answer to this very stop; a state that anybody may have
        published confirms nothing.
        """
        try:
            self._check_process()
            return self._stop(timeout_s)
        except NotConfirmed:
            raise
        except Exception as error:
            raise NotConfirmed(str(error) or type(error).__name__) from error

    def _stop(self, timeout_s: float) -> pb.ArmState:
        nonce, until_s = os.urandom(16), time.monotonic() + timeout_s
        with contextlib.suppress(DaemonUnreachable), network.failing_in_words():
            self._session.put(self._key(ESTOP), nonce, **_URGENT)
        while (left_s := until_s - time.monotonic()) > 0.0:
            # What fails may go well again in time: a connection that is lost is made anew.
            with contextlib.suppress(DaemonUnreachable, MessageRejected):
                for reply in self._ask(
                    ESTOP, nonce, pb.Reply, min(left_s, _STOP_AGAIN_S), **_URGENT
                ):
                    if reply.accepted and reply.mode == pb.ESTOP and reply.nonce == nonce:
                        return self._stopped(reply, until_s)
            time.sleep(0.01)  # nobody takes the question: no daemon, or one that starts
        raise NotConfirmed(f"the daemon of arm {self.arm!r} did not answer the stop")

    def _stopped(self, reply: pb.Reply, until_s: float) -> pb.ArmState:
        """Return the state of the tick that stopped, or what the answer tells of it."""
        with contextlib.suppress(DaemonUnreachable):
            while (left_s := until_s - time.monotonic()) > 0.0:
                state = self.state(left_s)
                if state.mode == pb.ESTOP and state.sequence >= reply.state_sequence:
                    return state
                time.sleep(0.002)
        return pb.ArmState(sequence=reply.state_sequence, mode=pb.ESTOP)

    # --- targets ---------------------------------------------------------------------------

    def send(self, target: pb.Target) -> int:
        """Send one target of any kind, once; return its sequence number.

        It must be sent again before the daemon's target timeout (200 ms), or the arm holds.
        """
        self._check_process()
        self._target = target
        self._sequence += 1
        target.client_id = self.client_id
        target.lease_secret = self._secret
        target.sequence = self._sequence
        target.state_sequence = self.state().sequence
        with network.failing_in_words():
            self._targets.put(target.SerializeToString())
        return self._sequence

"""The gateway process: Zenoh on one side, the command pipe and the tick ring on the other.

Every message is checked here before it becomes a command. Zenoh's callbacks only check and pass
on; nothing in them waits, so that a stop behind them is never delayed.
"""

import os
import secrets
import select
import threading
import time
from multiprocessing.connection import Connection
from typing import cast

import zenoh

from pneuarm.controllers.arm.errors import LeaseRefused, MessageRejected
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import decode, encode, encoding_of, is_json
from pneuarm.logs.schema.topics import (
    ALIVE_CLIENT,
    ALIVE_DAEMON,
    ESTOP,
    HEALTH,
    INFO,
    MODE,
    TARGET,
    TIP_POSE,
    full_key,
)
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.network import sessions as network
from pneuarm.service.processes.pipe import Heartbeat, ModeReply, Pipe, RequestMode
from pneuarm.service.processes.shared import (
    Shared,
    end_with_parent,
    ignore_terminal_signals,
    parent_is_alive,
)
from pneuarm.service.wire.gateway_events import Notes
from pneuarm.service.wire.inbox import Inbox
from pneuarm.service.wire.lease import Lease
from pneuarm.service.wire.publisher import Publisher

_PERIOD_S = 0.01
_HEARTBEAT_S = 0.05

#: Without a supervisor: time for the last states, and for Zenoh to close.
_ORPHAN_S = 3.0

#: A stop without control's answer for so long is repeated; control answers in its next tick.
_REPEAT_STOP_S = 0.02

_EVENTS = {
    pb.ENABLE: ModeEvent.ENABLE,
    pb.HOLD_NOW: ModeEvent.HOLD,
    pb.VENT: ModeEvent.VENT,
    pb.RESET: ModeEvent.RESET,
}


class Gateway:
    """Checks what comes in, answers queries, publishes what the ring holds."""

    def __init__(
        self, shared: Shared, requests: Pipe, stream: Pipe, session: zenoh.Session
    ) -> None:
        control = shared.configuration.control
        self._shared, self._session = shared, session
        # A stop never queues behind targets or poses: those have a pipe of their own.
        self._requests, self._stream = requests, stream
        self._arm = shared.configuration.build_arm()
        self._lease = Lease(control.lease_timeout_s)
        self._publisher = Publisher(shared, self._arm, session)
        self._lock = threading.RLock()  # Zenoh calls back from threads of its own
        self._notes = Notes(shared, self._publisher, self._lease, self._lock)
        self._inbox = Inbox(shared, stream, self._lease, self._publisher, self._notes)
        self._pending: dict[int, tuple[zenoh.Query, str, str]] = {}
        self._request_id = 2 * secrets.randbelow(2**40)  # no reply to a dead gateway matches
        self._stop_asked = 0  # number of the newest request to stop that is not answered yet
        self._stop_asked_s = 0.0
        self._declared = self._declare()

    def _declare(self) -> list[object]:
        """Declare keys; command keys are plain subscriptions, never cached for late joiners."""
        session, name = self._session, self._arm.name
        alive = full_key(name, f"{ALIVE_CLIENT}/*")
        return [
            session.declare_subscriber(full_key(name, TARGET.key), self._inbox.on_target),
            session.declare_subscriber(full_key(name, ESTOP.key), self._on_estop),
            session.declare_subscriber(full_key(name, TIP_POSE.key), self._inbox.on_tip_pose),
            session.declare_queryable(full_key(name, MODE.key), self._on_mode),
            session.declare_queryable(full_key(name, INFO.key), self._on_info),
            session.liveliness().declare_subscriber(alive, self._on_alive),
            session.liveliness().declare_token(full_key(name, ALIVE_DAEMON)),
        ]

    def _on_estop(self, sample: zenoh.Sample) -> None:
        """Stop, whatever was sent and whoever sent it; asked again until control has answered."""
        self._ask_to_stop()

    def _ask_to_stop(self) -> None:
        with self._lock:
            self._stop_asked = self._request(ModeEvent.ESTOP, "a client")
            self._stop_asked_s = time.monotonic()

    def _on_alive(self, sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.DELETE:
            client = str(sample.key_expr).rsplit("/", 1)[-1]
            with self._lock:
                held = self._lease.client_gone(client)
            if held:
                self._request(ModeEvent.LEASE_LOST, client)

    def _on_info(self, query: zenoh.Query) -> None:
        encoding = str(query.encoding) if query.payload is not None else ""
        self._reply(query, self._shared.info, encoding)

    def _on_mode(self, query: zenoh.Query) -> None:
        encoding = str(query.encoding)
        payload = b"" if query.payload is None else query.payload.to_bytes()
        request = pb.ModeRequest()
        try:
            request = decode(pb.ModeRequest, payload, encoding)
            self._handle(request, query, encoding)
        except (MessageRejected, LeaseRefused) as error:
            self._notes.reject(MODE.key, str(error), request.client_id)
            refusal = pb.LEASE_REFUSED if isinstance(error, LeaseRefused) else pb.BAD_REQUEST
            self._reply(query, self._state_reply(refusal, str(error), ""), encoding)

    def _handle(self, request: pb.ModeRequest, query: zenoh.Query, encoding: str) -> None:
        now_s = time.monotonic()
        secret = request.lease_secret
        if len(request.client_id) > 64:
            raise MessageRejected(
                f"client_id has {len(request.client_id)} characters; at most 64 are allowed"
            )
        with self._lock:
            if request.action in (pb.ENABLE, pb.TAKE_LEASE):
                secret, taken = self._lease.take(
                    request.client_id, request.lease_secret, request.take_over, now_s
                )
                if taken:  # the arm holds, and the new holder arms again
                    self._request(ModeEvent.LEASE_LOST, request.client_id)
            elif request.action == pb.RELEASE_LEASE:
                self._lease.release(request.client_id, secret)
                self._request(ModeEvent.LEASE_RELEASED, request.client_id)
        event = _EVENTS.get(request.action)
        if event is not None:
            self._request(event, request.client_id, (query, encoding, secret))
        elif request.action in (pb.TAKE_LEASE, pb.RELEASE_LEASE):
            self._reply(query, self._state_reply(pb.NOT_REFUSED, "", secret), encoding)
        else:
            names = ", ".join(pb.Action.keys()[1:])
            raise MessageRejected(f"action = {request.action}: missing or unknown; one of {names}")

    def _request(
        self, event: ModeEvent, client: str, asked: tuple[zenoh.Query, str, str] | None = None
    ) -> int:
        """Pass an event to control, return its number; the reply goes to the query that asked."""
        with self._lock:
            self._request_id = number = self._request_id + 2  # even: the gateway's
            if asked is not None:
                self._pending[number] = asked
            sent = self._requests.send(RequestMode(event, number, client))
            if not sent and asked is not None:
                del self._pending[number]
        if not sent and asked is not None:
            reason = "the control process does not answer"
            self._reply(asked[0], self._state_reply(pb.MODE_REFUSED, reason, asked[2]), asked[1])
        return number

    def _state_reply(self, refusal: "pb.Refusal", reason: str, secret: str) -> pb.Reply:
        return pb.Reply(
            accepted=refusal == pb.NOT_REFUSED,
            refusal=refusal,
            reason=reason,
            lease_secret=secret,
            lease_holder=self._lease.holder,
            mode=self._publisher.newest_mode,
            state_sequence=self._publisher.newest_sequence,
        )

    @staticmethod
    def _reply(query: zenoh.Query, message: pb.Reply | pb.Info, encoding: str) -> None:
        answer = encoding if is_json(encoding) else encoding_of(message)
        with query:
            query.reply(query.key_expr, encode(message, answer), encoding=answer)

    def _answer(self, reply: ModeReply) -> None:
        with self._lock:
            asked = self._pending.pop(reply.request_id, None)
            if reply.mode == Mode.ESTOP and reply.request_id >= self._stop_asked:
                self._stop_asked = 0
        if asked is None:
            return
        query, encoding, secret = asked
        refusal = pb.NOT_REFUSED if reply.accepted else pb.MODE_REFUSED
        message = self._state_reply(refusal, reply.reason, secret)
        message.mode = cast("pb.Mode", int(reply.mode))
        message.state_sequence = reply.sequence
        self._publisher.newest_mode = message.mode
        self._reply(query, message, encoding)

    def run(self, end: Connection) -> None:
        """Publish at the wire's rates until the supervisor is gone or says to end."""
        heartbeat_s = 0.0
        next_s = time.monotonic()
        while parent_is_alive() and not end.poll():
            self._insist_on_stop()
            next_s = max(next_s + _PERIOD_S, time.monotonic())
            self._answer_until(next_s)
            now_s = time.monotonic()
            if now_s - heartbeat_s >= _HEARTBEAT_S:
                heartbeat_s = now_s
                self._requests.send(Heartbeat(operator=self._lease.has_operator(now_s)))
            for health in self._publisher.step(
                now_s,
                self._notes.rejected,
                self._requests.dropped + self._stream.dropped,
                self._lease.holder,
            ):
                self._notes.log(HEALTH, health, time.monotonic_ns())

    def _insist_on_stop(self) -> None:
        """Repeat a stop that control has not answered yet, should its message have been lost.

        A state that shows a stop is no answer: it may be that of the stop before, and a reset may
        lie between. Nor is it repeated once it is answered: that would undo such a reset.
        """
        with self._lock:
            waited_s = time.monotonic() - self._stop_asked_s
            if self._stop_asked and waited_s > _REPEAT_STOP_S:
                self._ask_to_stop()

    def _answer_until(self, until_s: float) -> None:
        """Pass control's replies on as they come, until it is time to publish."""
        while (remaining := until_s - time.monotonic()) > 0:
            readable, _, _ = select.select([self._requests], [], [], remaining)
            while readable and (message := self._requests.receive()) is not None:
                if isinstance(message, ModeReply):
                    self._answer(message)
            if (
                self._requests.closed
            ):  # control has ended; the last states are still to be published
                time.sleep(max(0.0, until_s - time.monotonic()))
                return


def main(shared: Shared, requests: Pipe, stream: Pipe, end: Connection) -> None:
    """Entry point of the process; ends when told through ``end``, or when its parent is gone."""
    ignore_terminal_signals()
    end_with_parent(_ORPHAN_S)
    zenoh_config = shared.configuration.zenoh
    session = network.open_listening(zenoh_config.listen, zenoh_config.config_file)
    try:
        Gateway(shared, requests, stream, session).run(end)
    finally:
        session.close()
        os._exit(0)  # Zenoh's threads may keep a Python process from ending

"""The gateway process: Zenoh on one side, the command pipe and the tick ring on the other.

Every message is checked here before it becomes a command. The stop is heard on Zenoh's own thread;
everything else waits in a mailbox of its key, so that a stop behind it is never delayed.
"""

import os
import secrets
import select
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing.connection import Connection
from typing import Any, cast

import zenoh

from pneuarm.controllers.arm.errors import LeaseRefused, MessageRejected
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import decode
from pneuarm.logs.schema.printable import printable
from pneuarm.logs.schema.topics import (
    ALIVE_CLIENT,
    ALIVE_DAEMON,
    ESTOP,
    HEALTH,
    INFO,
    MODE,
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
from pneuarm.service.wire.allowance import Allowance
from pneuarm.service.wire.answers import Answer
from pneuarm.service.wire.gateway_events import Notes
from pneuarm.service.wire.inbox import Inbox
from pneuarm.service.wire.lease import Lease, check_name
from pneuarm.service.wire.mailbox import at_once, last_resort, serve
from pneuarm.service.wire.publisher import Publisher

_PERIOD_S = 0.01
_HEARTBEAT_S = 0.05

#: Without a supervisor: time for the last states, and for Zenoh to close.
_ORPHAN_S = 3.0

#: A stop without control's answer for so long is repeated; control answers in its next tick.
_REPEAT_STOP_S = 0.02

#: Requests for one action in a second: from who proves to hold the lease, and from all others.
_REQUESTS_PER_S = 100.0

#: No request is larger; reading one as large as a target may be takes 30 ms.
_REQUEST_BYTES = 2048

#: Queries that wait for control's answer, or to be read; the newest requests are kept.
_WAITING = 256

#: What was sent with a stop is returned with its answer, up to this length.
_NONCE_BYTES = 64

#: A thread that is busy with a message gives way to the others so often.
_SWITCH_S = 0.0005

_EVENTS = {
    pb.ENABLE: ModeEvent.ENABLE,
    pb.HOLD_NOW: ModeEvent.HOLD,
    pb.VENT: ModeEvent.VENT,
    pb.RESET: ModeEvent.RESET,
}


@dataclass(frozen=True)
class _Asked:
    """A query whose answer control has to give."""

    query: zenoh.Query
    key: str
    secret: str = ""
    nonce: bytes | None = None  # of a stop: what was sent with it


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
        self._info = Answer(shared.info)
        self._lock = threading.RLock()  # every key has a thread of its own
        # A stop waits for this one only, which nobody holds for longer than it takes to send.
        self._request_lock = threading.RLock()
        self._notes = Notes(shared, self._publisher, self._lease, self._lock)
        self._inbox = Inbox(shared, stream, self._lease, self._publisher, self._notes)
        self._pending: dict[int, _Asked] = {}
        self._allowances: dict[tuple[int, bool], Allowance] = {}
        self._request_id = 2 * secrets.randbelow(2**40)  # no reply to a dead gateway matches
        self._stop_asked = 0  # number of the newest request to stop that is not answered yet
        self._stop_asked_s = 0.0
        self._declared = self._declare()

    def _declare(self) -> list[object]:
        """Declare keys; what is asked is answered by a thread of the key's own."""
        session, name = self._session, self._arm.name
        alive = full_key(name, f"{ALIVE_CLIENT}/*")
        stop = full_key(name, ESTOP.key)

        def answering(key: str, work: Callable[[zenoh.Query], None]) -> object:
            declare = partial(session.declare_queryable, full_key(name, key))
            return serve(declare, last_resort(work, partial(self._refuse, key)), _WAITING)

        def heed(work: Callable[[Any], None]) -> Any:
            return at_once(last_resort(work, self._refuse_at_once))

        return [
            session.declare_subscriber(stop, heed(self._on_estop)),
            session.declare_queryable(stop, heed(self._on_estop_query)),
            *self._inbox.listen(session, name),
            answering(MODE.key, self._on_mode),
            answering(INFO.key, self._on_info),
            *(
                answering(topic.key, partial(self._publisher.on_latest, topic))
                for topic in self._publisher.queried
            ),
            session.liveliness().declare_subscriber(alive, heed(self._on_alive)),
            session.liveliness().declare_token(full_key(name, ALIVE_DAEMON)),
        ]

    def _refuse(self, key: str, query: zenoh.Query, why: str) -> None:
        """Answer a query that could not be handled: one sentence to who asked, and to the log."""
        self._notes.reject(key, why)
        with query, suppress(zenoh.ZError):
            query.reply_err(f"{key}: {why}")

    def _refuse_at_once(self, item: zenoh.Sample | zenoh.Query, why: str) -> None:
        """Tell of a sample or query of the stop, or of a token, that could not be handled."""
        self._notes.reject(str(item.key_expr).split("/", 2)[-1], why)

    def _on_estop(self, sample: zenoh.Sample) -> None:
        """Stop, whatever was sent and whoever sent it; asked again until control has answered."""
        self._ask_to_stop()

    def _on_estop_query(self, query: zenoh.Query) -> None:
        """Stop, and answer when control has: with what was sent, so that it is no old answer.

        Who asks a wildcard for whatever there is does not mean the stop.
        """
        if not str(query.key_expr).endswith(ESTOP.key):
            query.drop()
            return
        with self._request_lock:
            number = self._ask_to_stop()
            payload = b"" if query.payload is None else query.payload.to_bytes()
            if len(self._pending) < _WAITING:
                key = full_key(self._arm.name, ESTOP.key)
                self._pending[number] = _Asked(query, key, nonce=payload[:_NONCE_BYTES])

    def _ask_to_stop(self) -> int:
        with self._request_lock:
            self._stop_asked = self._request(ModeEvent.ESTOP, "a client")
            self._stop_asked_s = time.monotonic()
            return self._stop_asked

    def _on_alive(self, sample: zenoh.Sample) -> None:
        client = str(sample.key_expr).rsplit("/", 1)[-1]
        if sample.kind != zenoh.SampleKind.DELETE or client != self._lease.holder:
            return
        with self._lock:
            held = self._lease.client_gone(client)
        if held:
            self._request(ModeEvent.LEASE_LOST, client)

    def _on_info(self, query: zenoh.Query) -> None:
        self._info.give(query, full_key(self._arm.name, INFO.key))

    def _on_mode(self, query: zenoh.Query) -> None:
        payload = b"" if query.payload is None else query.payload.to_bytes()
        request = pb.ModeRequest()
        holder = self._lease.is_proved_by(payload)
        asked = _Asked(query, full_key(self._arm.name, MODE.key))
        try:
            request = decode(
                pb.ModeRequest, payload, str(query.encoding), most_bytes=_REQUEST_BYTES
            )
            self._check_request(request, holder)
            self._handle(request, asked)
        except (MessageRejected, LeaseRefused) as error:
            self._notes.reject(MODE.key, str(error), request.client_id, holder=holder)
            refusal = pb.LEASE_REFUSED if isinstance(error, LeaseRefused) else pb.BAD_REQUEST
            self._reply(asked, self._state_reply(refusal, printable(str(error)), ""))

    def _check_request(self, request: pb.ModeRequest, holder: bool) -> None:
        """Raise for an unknown action, a name that cannot be told, or too many requests."""
        if request.action not in pb.Action.values()[1:]:
            names = ", ".join(pb.Action.keys()[1:])
            raise MessageRejected(f"action = {request.action}: missing or unknown; one of {names}")
        if request.client_id:
            check_name(request.client_id)
        allowance = self._allowances.setdefault(
            (request.action, holder), Allowance(_REQUESTS_PER_S)
        )
        if not allowance.take(time.monotonic()):
            raise MessageRejected(
                f"too many requests: {_REQUESTS_PER_S:g} a second are taken for "
                f"{pb.Action.Name(request.action)}"
            )

    def _handle(self, request: pb.ModeRequest, asked: _Asked) -> None:
        now_s = time.monotonic()
        secret = request.lease_secret
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
            self._request(event, request.client_id, replace(asked, secret=secret))
        else:
            self._reply(asked, self._state_reply(pb.NOT_REFUSED, "", secret))

    def _request(self, event: ModeEvent, client: str, asked: _Asked | None = None) -> int:
        """Pass an event to control, return its number; the reply goes to the query that asked."""
        with self._request_lock:
            self._request_id = number = self._request_id + 2  # even: the gateway's
            if asked is not None:
                self._pending[number] = asked
            sent = self._requests.send(RequestMode(event, number, client))
            if not sent and asked is not None:
                del self._pending[number]
        if not sent and asked is not None:
            why = "the control process does not answer"
            self._reply(asked, self._state_reply(pb.MODE_REFUSED, why, asked.secret))
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
            version=self._shared.info.versions["pneuarm"],
        )

    @staticmethod
    def _reply(asked: _Asked, message: pb.Reply) -> None:
        Answer(message).give(asked.query, asked.key)

    def _answer(self, reply: ModeReply) -> None:
        """Pass on what control has said; an arm that is stopped answers every stop before it."""
        with self._request_lock:
            answered = [reply.request_id]
            if reply.mode == Mode.ESTOP:
                waiting = self._pending.items()
                answered += [
                    n for n, it in waiting if it.nonce is not None and n < reply.request_id
                ]
                if reply.request_id >= self._stop_asked:
                    self._stop_asked = 0
            found = [self._pending.pop(number, None) for number in answered]
        for asked in found:
            if asked is not None:
                self._pass_on(reply, asked)

    def _pass_on(self, reply: ModeReply, asked: _Asked) -> None:
        stopped = asked.nonce is not None and reply.mode == Mode.ESTOP
        reason = "" if stopped else reply.reason
        refusal = pb.NOT_REFUSED if reply.accepted or stopped else pb.MODE_REFUSED
        message = self._state_reply(refusal, reason, asked.secret)
        message.mode = cast("pb.Mode", int(reply.mode))
        message.state_sequence, message.nonce = reply.sequence, asked.nonce or b""
        self._publisher.newest_mode = message.mode
        self._reply(asked, message)

    def run(self, end: Connection) -> None:
        """Publish at the wire's rates until the supervisor is gone or says to end."""
        heartbeat_s = 0.0
        next_s = time.monotonic()
        while parent_is_alive() and not end.poll():
            self._insist_on_stop()
            self._notes.step()
            next_s = max(next_s + _PERIOD_S, time.monotonic())
            self._answer_until(next_s)
            now_s = time.monotonic()
            if now_s - heartbeat_s >= _HEARTBEAT_S:
                heartbeat_s = now_s
                self._requests.send(Heartbeat(operator=self._lease.has_operator(now_s)))
            for health in self._publisher.step(
                now_s,
                self._notes.refused,
                self._requests.dropped + self._stream.dropped,
                self._lease.holder,
            ):
                self._notes.log(HEALTH, health, time.monotonic_ns())

    def _insist_on_stop(self) -> None:
        """Repeat a stop that control has not answered yet, should its message have been lost.

        A state that shows a stop is no answer: it may be that of the stop before, and a reset may
        lie between. Nor is it repeated once it is answered: that would undo such a reset.
        """
        with self._request_lock:
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
    sys.setswitchinterval(_SWITCH_S)
    zenoh_config = shared.configuration.zenoh
    session = network.open_listening(zenoh_config.listen, zenoh_config.config_file)
    try:
        Gateway(shared, requests, stream, session).run(end)
    finally:
        session.close()
        os._exit(0)  # Zenoh's threads may keep a Python process from ending

"""Every message that is taken from the wire, with any values in any fields: done or refused.

The gateway's callbacks run here as on the wire, from bytes, with the rings and pipes of a daemon
and without Zenoh.
"""

import threading
from dataclasses import dataclass, field
from multiprocessing import get_context
from types import SimpleNamespace
from typing import Any

import pytest
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf import json_format
from google.protobuf.message import Message
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pneuarm.logs.rings.rings import MessageReader, Rings
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import JSON, PROTOBUF
from pneuarm.logs.schema.topics import EVENT
from pneuarm.service.configuration.configuration import load
from pneuarm.service.processes.pipe import Pipe, SetTarget, SetTipPose, new_pipe
from pneuarm.service.wire import answers
from pneuarm.service.wire.allowance import Allowance
from pneuarm.service.wire.answers import Answer
from pneuarm.service.wire.gateway import Gateway
from pneuarm.service.wire.gateway_events import Notes
from pneuarm.service.wire.inbox import Inbox
from pneuarm.service.wire.lease import Lease
from pneuarm.service.wire.mailbox import last_resort
from tools.rig.messages import messages

CONTEXT = get_context("spawn")
RINGS = Rings.create(CONTEXT, 1, 50.0)
CONFIGURATION = load()
ANY = settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@dataclass
class Sample:
    """What Zenoh hands over."""

    payload: Any
    encoding: str = PROTOBUF
    key_expr: str = "pneuarm/paper/sensor/tip_pose"
    attachment: Any = None
    source_info: Any = None
    replies: list[bytes] = field(default_factory=list)

    @classmethod
    def of(cls, payload: bytes, encoding: str = PROTOBUF) -> "Sample":
        return cls(SimpleNamespace(to_bytes=lambda: payload), encoding)


class Taking:
    """A gateway's inbox of an active arm, whose lease `me` holds."""

    def __init__(self) -> None:
        self.shared = SimpleNamespace(
            configuration=CONFIGURATION, rings=RINGS, unix_ns=lambda monotonic_ns: monotonic_ns
        )
        self.publisher = SimpleNamespace(newest_mode=pb.ACTIVE, newest_sequence=1000)
        self.lease = Lease(5.0)
        self.secret, _ = self.lease.take("me", "", False, 0.0)
        self.events = MessageReader((RINGS.gateway,))
        self.events.read()
        self.notes = Notes(self.shared, self.publisher, self.lease, threading.RLock())  # type: ignore[arg-type]
        self.stream, self._control = new_pipe()
        self.inbox = Inbox(self.shared, self.stream, self.lease, self.publisher, self.notes)  # type: ignore[arg-type]
        for name in ("_holders", "_poses", "_strangers"):
            setattr(self.inbox, name, Allowance(1e9))

    def passed_on(self) -> list[object]:
        found = []
        while (command := self._control.receive()) is not None:
            found.append(command)
        return found

    def told(self) -> list[pb.Event]:
        read = self.events.read()
        return [pb.Event.FromString(payload) for topic, payload, _ in read if topic is EVENT]

    def check_one_or_the_other(self, before: int, kind: type) -> None:
        """Either the command went on, or one event says in one sentence why it did not."""
        commands, refused = self.passed_on(), self.notes.refused - before
        assert len(commands) + refused == 1
        assert all(isinstance(command, kind) for command in commands)
        rejected = [event for event in self.told() if event.code == "rejected"]
        assert len(rejected) == refused
        for event in rejected:
            assert event.text.isprintable()
            assert event.client_id.isprintable()


def sent_as(message: Message, as_json: bool) -> Sample:
    if as_json:
        return Sample.of(json_format.MessageToJson(message).encode("utf-8", "replace"), JSON)
    return Sample.of(message.SerializeToString())


@ANY
@given(messages(pb.Target), st.booleans())
def test_any_target_of_the_holder_is_followed_or_refused(message: Message, as_json: bool) -> None:
    taking = Taking()
    assert isinstance(message, pb.Target)
    message.client_id, message.lease_secret = "me", taking.secret
    message.sequence, message.state_sequence = 1, 1000
    taking_target = last_resort(
        taking.inbox.on_target, lambda sample, why: taking.notes.reject("cmd/target", why)
    )
    taking_target(sent_as(message, as_json))
    taking.check_one_or_the_other(0, SetTarget)


@ANY
@given(messages(pb.Target), st.booleans())
def test_any_target_of_a_stranger_is_refused(message: Message, as_json: bool) -> None:
    taking = Taking()
    taking.inbox.on_target(sent_as(message, as_json))
    assert taking.notes.refused == 1
    taking.check_one_or_the_other(0, SetTarget)


@ANY
@given(messages(PoseInFrame), st.booleans())
def test_any_pose_is_taken_or_refused(message: Message, as_json: bool) -> None:
    try:
        sample = sent_as(message, as_json)
    except (ValueError, OverflowError, json_format.Error):  # a stamp that JSON cannot hold
        sample = sent_as(message, False)
    taking = Taking()
    taking.inbox.on_tip_pose(sample)  # without the last resort: every refusal was thought of
    commands = taking.passed_on()
    assert len(commands) + taking.notes.refused == 1
    assert all(isinstance(command, SetTipPose) for command in commands)


@given(st.binary(max_size=200), st.sampled_from([PROTOBUF, JSON, "", "text/json;x", "\x1b;\n"]))
def test_any_bytes_are_refused(payload: bytes, encoding: str) -> None:
    taking = Taking()
    taking.inbox.on_target(Sample.of(payload, encoding))
    taking.check_one_or_the_other(0, SetTarget)
    taking.inbox.on_tip_pose(Sample.of(payload, encoding))
    assert taking.notes.refused == 2


class Query(Sample):
    """A query that keeps its answers."""

    def __enter__(self) -> "Query":
        return self

    def __exit__(self, *error: object) -> None:
        return None

    def reply(self, key: str, payload: bytes, encoding: str) -> None:
        self.replies.append(payload)


def gateway_with_pipe() -> tuple[Gateway, Pipe]:
    """A gateway without a session, and control's end of its pipe."""
    taking, gateway = Taking(), Gateway.__new__(Gateway)
    requests, control = new_pipe()
    gateway.__dict__ |= {
        "_arm": SimpleNamespace(name="paper"),
        "_shared": SimpleNamespace(info=SimpleNamespace(versions={"pneuarm": "0"})),
        "_lease": taking.lease,
        "_notes": taking.notes,
        "_publisher": taking.publisher,
        "_lock": threading.RLock(),
        "_request_lock": threading.RLock(),
        "_requests": requests,
        "_request_id": 0,
        "_pending": {},
        "_allowances": {},
    }
    return gateway, control


@ANY
@given(messages(pb.ModeRequest), st.booleans())
def test_any_request_is_passed_on_or_answered(message: Message, as_json: bool) -> None:
    gateway, control = gateway_with_pipe()
    sample = sent_as(message, as_json)
    query = Query(sample.payload, sample.encoding, "pneuarm/paper/cmd/mode")
    gateway._on_mode(query)  # type: ignore[arg-type]
    assert len(query.replies) + len(gateway._pending) == 1
    assert isinstance(control, Pipe)


def test_a_request_that_takes_long_to_read_is_refused_unread() -> None:
    """It would stand before those of everybody else: 256 of them for 9 s."""
    gateway, _ = gateway_with_pipe()
    sample = Sample.of(b'{"client_id": "' + b"a" * 60000 + b'"}', JSON)
    query = Query(sample.payload, PROTOBUF, "pneuarm/paper/cmd/mode")
    gateway._on_mode(query)  # type: ignore[arg-type]
    assert "60017 bytes" in pb.Reply.FromString(query.replies[0]).reason


def test_what_is_asked_for_again_is_encoded_once(monkeypatch: pytest.MonkeyPatch) -> None:
    encoded = []
    monkeypatch.setattr(answers, "encode", lambda *args: encoded.append(args) or b"x")
    newest = Answer(pb.ArmState(sequence=7))
    for encoding in (JSON, "text/json", PROTOBUF, "") * 50:
        query = Query(None, encoding)
        newest.give(query, "pneuarm/paper/state")  # type: ignore[arg-type]
        assert query.replies == [b"x"]
    assert len(encoded) == 2


def test_what_nobody_thought_of_is_one_sentence_that_says_where() -> None:
    found: list[str] = []

    def fails(item: object) -> None:
        raise ZeroDivisionError("\x1b[31m")

    last_resort(fails, lambda item, why: found.append(why))(None)
    (why,) = found
    assert "ZeroDivisionError" in why
    assert __name__ in why
    with pytest.raises(KeyboardInterrupt):
        last_resort(interrupted, lambda item, why: found.append(why))(None)


def interrupted(item: object) -> None:
    raise KeyboardInterrupt

"""The bare wire for the tests: keys, payloads and encodings, past our own Client."""

import json
from types import TracebackType
from typing import Any

import zenoh
from google.protobuf import json_format
from google.protobuf.message import Message

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import full_key
from pneuarm.service.network.sessions import open_connected
from tools.rig.daemon import PATIENCE_S, Daemon, wait_for

JSON = "application/json"
PROTOBUF = "application/protobuf"


def encoded(message_type: type[Message], fields: dict[str, Any], encoding: str) -> bytes:
    """Return the same fields as a foreign program would send them, in either encoding."""
    if encoding == JSON:
        return json.dumps(fields).encode()
    return json_format.ParseDict(fields, message_type()).SerializeToString()


def decoded(message_type: type[Message], sample: zenoh.Sample) -> Message:
    """Read an answer in the encoding that it names."""
    payload = sample.payload.to_bytes()
    if str(sample.encoding) == JSON:
        return json_format.ParseDict(json.loads(payload), message_type())
    assert str(sample.encoding) == f"{PROTOBUF};{message_type.DESCRIPTOR.full_name}"
    return message_type.FromString(payload)


class Wire:
    """A program that speaks to a daemon with nothing but Zenoh."""

    def __init__(self, daemon: Daemon, name: str = "wire") -> None:
        self.arm, self.name = daemon.arm, name
        self.session = open_connected(daemon.endpoint)
        self._states = self.listen("state", zenoh.handlers.RingChannel(1))
        self._newest = pb.ArmState()
        self.secret = ""
        self.sequence = 0

    def __enter__(self) -> "Wire":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.session.close()

    def key(self, key: str) -> str:
        """Full key of this arm."""
        return full_key(self.arm, key)

    def listen(self, key: str, handler: Any = None) -> Any:
        """Subscribe to a key."""
        return self.session.declare_subscriber(
            self.key(key), handler or zenoh.handlers.FifoChannel(4096)
        )

    def put(self, key: str, payload: bytes, encoding: str = PROTOBUF) -> None:
        """Put a payload; a large one waits until it is taken instead of being dropped."""
        self.session.put(
            self.key(key),
            payload,
            encoding=encoding,
            congestion_control=zenoh.CongestionControl.BLOCK,
        )

    def ask(self, key: str, payload: bytes | None, encoding: str) -> zenoh.Sample:
        """Query a key and return the one answer."""
        replies = list(
            self.session.get(self.key(key), payload=payload, encoding=encoding, timeout=PATIENCE_S)
        )
        (reply,) = replies
        assert reply.ok is not None
        return reply.ok

    def mode(self, action: str, encoding: str = PROTOBUF, **fields: Any) -> pb.Reply:
        """Ask for a mode; a secret that is granted is kept."""
        request = {
            "client_id": self.name,
            "lease_secret": self.secret,
            "action": action,
        } | fields
        answer = self.ask("cmd/mode", encoded(pb.ModeRequest, request, encoding), encoding)
        assert str(answer.encoding).startswith(encoding)
        reply = decoded(pb.Reply, answer)
        assert isinstance(reply, pb.Reply)
        if reply.lease_secret:
            self.secret, self.sequence = (
                reply.lease_secret,
                0 if reply.lease_secret != self.secret else self.sequence,
            )
        return reply

    def state(self) -> pb.ArmState:
        """Return the newest state."""

        def newest() -> bool:
            sample = self._states.try_recv()
            if sample is not None:
                self._newest = pb.ArmState.FromString(sample.payload.to_bytes())
            return sample is not None

        wait_for(newest, "a state")
        return self._newest

    def heading(self) -> dict[str, Any]:
        """Return what every target must carry: who, secret, numbers."""
        self.sequence += 1
        return {
            "client_id": self.name,
            "lease_secret": self.secret,
            "sequence": self.sequence,
            "state_sequence": self.state().sequence,
        }

    def send(self, target: dict[str, Any], encoding: str = PROTOBUF) -> int:
        """Put one target as it should be; return its number."""
        fields = self.heading() | target
        self.put("cmd/target", encoded(pb.Target, fields, encoding), encoding)
        return self.sequence

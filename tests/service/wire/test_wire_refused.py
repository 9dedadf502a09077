"""Bad input over the wire: an event says why, the sender of a query is told, nothing changes."""

import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf import json_format

from pneuarm.logs.schema import pneuarm_pb2 as pb
from tools.rig.daemon import Daemon, wait_for
from tools.rig.wire import JSON, PROTOBUF, Wire, decoded, encoded

GOOD = {"x": 0.02, "y": -0.01, "z": 0.21}
UPRIGHT = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    tables = {"control": {"target_timeout_ms": 2000}}
    with Daemon(tmp_path_factory.mktemp("refused"), tables) as daemon:
        yield daemon


class Follower(Wire):
    """An operator whose arm stands at GOOD, and who goes on refreshing that."""

    def __init__(self, daemon: Daemon) -> None:
        super().__init__(daemon)
        self.events = self.listen("event")

    def refresh(self) -> pb.ArmState:
        self.send({"position": {"frame_id": "base", "position_m": GOOD}})
        return self.state()

    def settle(self) -> None:
        if self.state().mode != pb.ACTIVE:
            assert self.mode("ENABLE").accepted
        wait_for(lambda: self.refresh().reach == pb.REACHED, "the position")
        wait_for(lambda: self.refresh().sequence > 3000, "ticks enough for an old state")
        while self.events.try_recv() is not None:
            pass

    def rejection(self) -> pb.Event | None:
        self.refresh()
        while (sample := self.events.try_recv()) is not None:
            event = decoded(pb.Event, sample)
            assert isinstance(event, pb.Event)
            if event.code in ("rejected", "mode_refused"):
                return event
        return None

    def check_refused(self, do: Callable[[], object], *words: str) -> pb.Event:
        """Do something wrong; check that an event tells why, and that nothing else happened."""
        before = self.refresh()
        do()
        event = wait_for(self.rejection, "the event that tells of the refusal")
        for word in words:
            assert word in event.text
        for _ in range(5):
            after = self.refresh()
            assert after.mode == pb.ACTIVE
            assert after.target_kind == pb.POSITION
            assert list(after.target_position_m) == list(GOOD.values())
            assert list(after.length_commanded_m) == pytest.approx(
                list(before.length_commanded_m), abs=1e-4
            )
        return event


@pytest.fixture(scope="module")
def connected(daemon: Daemon) -> Iterator[Follower]:
    with Follower(daemon) as follower:
        yield follower


@pytest.fixture
def follower(connected: Follower) -> Follower:
    connected.settle()
    return connected


def position(**values: Any) -> dict[str, Any]:
    return {"position": {"frame_id": "base", "position_m": GOOD} | values}


WRONG_FIELDS: dict[str, tuple[dict[str, Any], str]] = {
    "nan": (position(position_m=GOOD | {"x": "NaN"}), "must be finite"),
    "infinite": (position(position_m=GOOD | {"z": "-Infinity"}), "must be finite"),
    "unknown frame": (position(frame_id="world"), "'world': unknown frame; allowed: 'base'"),
    "no frame": (position(frame_id=""), "unknown frame"),
    "millimetres": (position(position_m={"x": 20.0, "y": 0.0, "z": 210.0}), "is it in mm?"),
    "long frame": (position(frame_id="\U0001f40d" * 5000), "frame_id = "),
    "no target": ({}, "holds no target"),
    "unknown law": (position() | {"law": 9}, "law = 9"),
    "wrong number": ({"lengths": {"length_m": [0.2, 0.2]}}, "2 values"),
    "length outside": ({"lengths": {"length_m": [0.2, 0.31, 0.2]}}, "chamber 2 is 0.31 m"),
    "pressure nan": ({"pressures": {"pressure_pa": [0.0, "NaN", 0.0]}}, "must be finite"),
    "pressure outside": ({"pressures": {"pressure_pa": [0.0, 0.0, 5e5]}}, "chamber 3 is 500000 Pa"),
    "no unit quaternion": (
        {"pose": {"frame_id": "base", "position_m": GOOD, "orientation": UPRIGHT | {"w": 2.0}}},
        "unit quaternion",
    ),
    "fast twist": (
        {"twist": {"frame_id": "base", "reference_point": "tip", "linear_m_s": {"x": 50.0}}},
        "is it in mm/s?",
    ),
    "no reference point": (
        {"twist": {"frame_id": "base", "linear_m_s": {"x": 0.01}}},
        "reference_point = ''",
    ),
    "another's lease": (position() | {"client_id": "stranger"}, "stranger has no lease; wire"),
    "wrong secret": (position() | {"lease_secret": "0" * 16}, "has no lease"),
    "sequence replayed": (position() | {"sequence": 1}, "sequence 1 is not above"),
    "old state": (position() | {"state_sequence": 1}, "has not seen a state for"),
    "state to come": (position() | {"state_sequence": 2**40}, "state_sequence = 1099511627776"),
}


@pytest.mark.parametrize("encoding", [PROTOBUF, JSON])
@pytest.mark.parametrize("name", WRONG_FIELDS)
def test_wrong_target(follower: Follower, name: str, encoding: str) -> None:
    wrong, words = WRONG_FIELDS[name]

    def put() -> None:
        fields = follower.heading() | wrong
        follower.put("cmd/target", encoded(pb.Target, fields, encoding), encoding)

    event = follower.check_refused(put, "cmd/target: ", words)
    assert event.source == "gateway"
    assert event.level == pb.WARNING
    assert event.client_id == wrong.get("client_id", "wire")


def whole(follower: Follower) -> bytes:
    return encoded(pb.Target, follower.heading() | position(), PROTOBUF)


HEALTH = pb.Health(ticks=7, rate_hz=1000.0, lease_holder="x").SerializeToString()

WRONG_PAYLOADS: dict[str, tuple[Callable[[Follower], bytes], str, str]] = {
    "truncated": (lambda follower: whole(follower)[:-3], PROTOBUF, "not the protobuf form"),
    "a megabyte": (lambda follower: bytes(1_000_000), PROTOBUF, "1000000 bytes; at most 65536"),
    "a megabyte of JSON": (lambda follower: b"[" * 1_000_000, JSON, "at most 65536"),
    "deep JSON": (lambda follower: b"[" * 60_000, JSON, "not the JSON form"),
    "other message": (
        lambda follower: HEALTH,
        PROTOBUF,
        "fields that pneuarm.Target does not have",
    ),
    "other message, named": (
        lambda follower: HEALTH,
        f"{PROTOBUF};pneuarm.Health",
        "message of type 'pneuarm.Health'; this key takes pneuarm.Target",
    ),
    "pose in frame": (
        lambda follower: PoseInFrame(frame_id="base").SerializeToString(),
        PROTOBUF,
        "cmd/target: ",
    ),
    "not JSON": (lambda follower: b"x = 20, y = 0", JSON, "not the JSON form"),
    "protobuf as JSON": (whole, JSON, "not the JSON form"),
    "JSON as protobuf": (lambda follower: b'{"sequence": 1}', PROTOBUF, "not the protobuf form"),
    "JSON list": (lambda follower: b"[1, 2]", JSON, "not the JSON form"),
    "JSON number": (lambda follower: b"17", JSON, "not the JSON form"),
    "JSON null": (lambda follower: b"null", JSON, "cmd/target: "),
    "bare NaN": (
        lambda follower: json.dumps(
            follower.heading() | position(position_m=GOOD | {"x": float("nan")})
        ).encode(),
        JSON,
        "not the JSON form",
    ),
    "unknown JSON field": (
        lambda follower: b'{"positionn": {}}',
        JSON,
        'no field named "positionn"',
    ),
    "bytes": (lambda follower: b"\xff\xfe\x00", JSON, "not the JSON form"),
    "nothing": (lambda follower: b"", PROTOBUF, "has no lease; wire has it"),
}


@pytest.mark.parametrize("name", WRONG_PAYLOADS)
def test_wrong_payload(follower: Follower, name: str) -> None:
    make, encoding, words = WRONG_PAYLOADS[name]
    payload = make(follower)
    event = follower.check_refused(lambda: follower.put("cmd/target", payload, encoding), words)
    secret = follower.secret.encode()
    assert event.payload == payload.replace(secret, b"*" * len(secret))[:200]


@pytest.mark.parametrize("payload", [b"\xff", b"", HEALTH])
def test_wrong_tip_pose(follower: Follower, payload: bytes) -> None:
    before = list(follower.state().tip_measured_position_m)
    follower.check_refused(lambda: follower.put("sensor/tip_pose", payload), "sensor/tip_pose: ")
    assert list(follower.state().tip_measured_position_m) == before


WRONG_REQUESTS: dict[str, tuple[dict[str, Any], str]] = {
    "not allowed now": ({"client_id": "wire", "action": "RESET"}, "mode is active: reset"),
    "no action": ({"client_id": "wire"}, "missing or unknown; one of TAKE_LEASE, ENABLE"),
    "another's arm": ({"client_id": "other", "action": "ENABLE"}, "wire holds the arm"),
    "nobody's": ({"action": "TAKE_LEASE"}, "client_id has 0 characters"),
    "another's release": ({"client_id": "other", "action": "RELEASE_LEASE"}, "does not hold"),
    "long name": ({"client_id": "n" * 65, "action": "HOLD_NOW"}, "client_id has 65 characters"),
    "longest name": (
        {"client_id": "n" * 65400, "action": "HOLD_NOW"},
        "at most 2048",
    ),
    "unknown action": ({"client_id": "wire", "action": 99}, "action"),
}


@pytest.mark.parametrize("encoding", [PROTOBUF, JSON])
@pytest.mark.parametrize("name", WRONG_REQUESTS)
def test_wrong_mode_request(follower: Follower, name: str, encoding: str) -> None:
    fields, words = WRONG_REQUESTS[name]
    payload = encoded(pb.ModeRequest, fields, encoding)
    replies = []

    def ask() -> None:
        replies.append(decoded(pb.Reply, follower.ask("cmd/mode", payload, encoding)))

    follower.check_refused(ask, words)
    assert not replies[0].accepted
    assert words in replies[0].reason
    assert replies[0].mode == pb.ACTIVE
    assert replies[0].lease_secret == ""


@pytest.mark.parametrize("payload", [b"\xff", b"{", None])
def test_request_that_is_none(follower: Follower, payload: bytes | None) -> None:
    replies = []

    def ask() -> None:
        sample = follower.ask("cmd/mode", payload, JSON)
        replies.append(json_format.Parse(sample.payload.to_bytes(), pb.Reply()))

    follower.check_refused(ask, "cmd/mode: ")
    assert not replies[0].accepted


def test_rejections_are_counted_and_logged(follower: Follower, daemon: Daemon) -> None:
    counted, logged = daemon.health().rejected_messages, daemon.codes().count("rejected")
    for name in WRONG_PAYLOADS:
        test_wrong_payload(follower, name)
    more = len(WRONG_PAYLOADS)
    wait_for(lambda: daemon.health().rejected_messages >= counted + more, "rejections in health")
    wait_for(lambda: daemon.codes().count("rejected") >= logged + more, "rejections in the log")
    assert follower.secret not in str(daemon.events())

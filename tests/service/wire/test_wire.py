"""Every key of the wire table, as protobuf and as JSON, against a real daemon."""

import tomllib
from collections.abc import Iterator
from typing import Any

import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf.message import Message

from pneuarm.logs.schema import pneuarm_pb2 as pb
from tools.rig.daemon import Daemon, wait_for
from tools.rig.wire import JSON, PROTOBUF, Wire, decoded, encoded

BOTH = pytest.mark.parametrize("encoding", [PROTOBUF, JSON])

POSITION = {"x": 0.02, "y": -0.01, "z": 0.21}
TARGETS: dict[str, dict[str, Any]] = {
    "position": {"frame_id": "base", "position_m": POSITION},
    "pose": {
        "frame_id": "base",
        "position_m": {"x": 0.0, "y": 0.0, "z": 0.2},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    },
    "twist": {
        "frame_id": "tip",
        "reference_point": "tip",
        "linear_m_s": {"x": 0.01, "y": 0.0, "z": 0.0},
    },
    "lengths": {"length_m": [0.21, 0.2, 0.2]},
    "pressures": {"pressure_pa": [5000.0, 10000.0, 15000.0]},
}


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    with Daemon(tmp_path_factory.mktemp("wire")) as daemon:
        yield daemon


@pytest.fixture
def wire(daemon: Daemon) -> Iterator[Wire]:
    with Wire(daemon) as wire:
        yield wire
        if wire.secret:
            wire.mode("RELEASE_LEASE")


@BOTH
@pytest.mark.parametrize("kind", TARGETS)
def test_target_of_every_kind_is_followed(wire: Wire, kind: str, encoding: str) -> None:
    assert wire.mode("ENABLE", encoding).accepted

    def followed() -> bool:
        number = wire.send({kind: TARGETS[kind]}, encoding)
        state = wire.state()
        name = pb.TargetKind.Name(state.target_kind)
        return name == kind.upper() and 0 < state.target_sequence <= number

    wait_for(followed, f"a state that follows the {kind}")
    assert wire.state().mode == pb.ACTIVE


@BOTH
def test_law_is_chosen_by_the_target(wire: Wire, encoding: str) -> None:
    wire.mode("ENABLE")
    for law in ("RESOLVED_RATE", "QP_IK"):
        target = {"position": TARGETS["position"], "law": law}

        def followed(target: dict[str, Any] = target, law: str = law) -> bool:
            wire.send(target, encoding)
            return wire.state().law == pb.Law.Value(law)

        wait_for(followed, f"law {law} in the state")


@BOTH
def test_every_mode_action_is_answered(wire: Wire, encoding: str) -> None:
    taken = wire.mode("TAKE_LEASE", encoding)
    assert taken.accepted
    assert taken.lease_holder == "wire"
    assert len(taken.lease_secret) >= 16
    wire.mode("VENT", encoding)
    wait_for(lambda: wire.state().mode == pb.READY, "ready after venting")
    for action, mode in (("ENABLE", pb.ACTIVE), ("HOLD_NOW", pb.HOLD), ("ENABLE", pb.ACTIVE)):
        reply = wire.mode(action, encoding)
        assert reply.accepted, reply.reason
        assert reply.mode == mode
        wait_for(lambda mode=mode: wire.state().mode == mode, f"{action} in the state")
        assert reply.state_sequence <= wire.state().sequence
    refused = wire.mode("RESET", encoding)
    assert not refused.accepted
    assert "active" in refused.reason
    assert wire.mode("RELEASE_LEASE", encoding).accepted
    wire.secret = ""


@BOTH
def test_info_says_what_the_daemon_is(wire: Wire, daemon: Daemon, encoding: str) -> None:
    info = decoded(pb.Info, wire.ask("info", b"", encoding))
    assert isinstance(info, pb.Info)
    assert tomllib.loads(info.config_toml)["arm"]["name"] == daemon.arm
    assert list(info.length_min_m) == [0.1] * 3
    assert info.log_path.startswith(str(daemon.logs))
    assert info.simulator["seed"] == 0
    assert "eclipse-zenoh" in info.versions


@BOTH
def test_measured_tip_pose_shows_in_the_state(wire: Wire, encoding: str) -> None:
    x = 0.031 if encoding == JSON else 0.032
    pose = {
        "frame_id": "base",
        "pose": {
            "position": {"x": x, "y": 0.0, "z": 0.2},
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
    }
    wire.put("sensor/tip_pose", encoded(PoseInFrame, pose, encoding), encoding)
    wait_for(lambda: list(wire.state().tip_measured_position_m)[:1] == [x], "the measured tip")
    assert list(wire.state().tip_measured_orientation_xyzw) == [0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize("payload", [b"", b'{"why": "no reason"}', b"\x00\xff" * 9])
def test_anything_at_all_stops(wire: Wire, payload: bytes) -> None:
    wire.put("cmd/estop", payload, JSON)
    wait_for(lambda: wire.state().mode == pb.ESTOP, "the stop")
    assert not wire.mode("ENABLE").accepted
    assert wire.mode("RESET").mode == pb.IDLE
    wait_for(lambda: wire.state().mode == pb.READY, "ready again")


OUTPUTS: dict[str, type[Message]] = {
    "state": pb.ArmState,
    "tip": PoseInFrame,
    "tf": FrameTransforms,
    "health": pb.Health,
}


@pytest.mark.parametrize("key", OUTPUTS)
def test_outputs_are_what_they_say(wire: Wire, key: str) -> None:
    subscriber = wire.listen(key)
    first, second = (wait_for(subscriber.try_recv, f"a sample of {key}") for _ in range(2))
    for sample in (first, second):
        assert decoded(OUTPUTS[key], sample).ByteSize() > 50
    assert first.payload.to_bytes() != second.payload.to_bytes()


@BOTH
@pytest.mark.parametrize("key", OUTPUTS)
def test_newest_can_be_asked_for(wire: Wire, key: str, encoding: str) -> None:
    sample = wire.ask(key, b"", encoding)
    assert str(sample.encoding).startswith(encoding)
    assert decoded(OUTPUTS[key], sample).ByteSize() > 50


def test_events_come_as_they_happen(wire: Wire) -> None:
    events = wire.listen("event")
    wire.mode("ENABLE")
    wire.mode("HOLD_NOW")

    def next_event() -> pb.Event:
        event = decoded(pb.Event, wait_for(events.try_recv, "an event"))
        assert isinstance(event, pb.Event)
        return event

    assert [next_event().code for _ in range(2)] == ["enable", "hold"]


def test_liveliness_tells_daemon_and_clients(wire: Wire, daemon: Daemon) -> None:
    def alive() -> set[str]:
        replies = wire.session.liveliness().get(wire.key("alive/**"), timeout=3.0)
        return {str(reply.ok.key_expr) for reply in replies if reply.ok is not None}

    assert wire.key("alive/daemon") in alive()
    with daemon.client() as client:
        token = wire.key(f"alive/client/{client.client_id}")
        wait_for(lambda: token in alive(), "the client's token")
    wait_for(lambda: token not in alive(), "the end of the client's token")


def test_commands_are_not_kept_for_late_joiners(wire: Wire, daemon: Daemon) -> None:
    wire.mode("ENABLE")
    wire.send({"position": TARGETS["position"]})
    with Wire(daemon, "late") as late:
        subscriber = late.listen("cmd/**")
        replies = late.session.get(late.key("cmd/target"), timeout=1.0)
        assert [reply for reply in replies if reply.ok is not None] == []
        assert subscriber.try_recv() is None

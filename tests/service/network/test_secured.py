"""The example of a secured network, attacked: each certificate may do what it should, no more."""

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import zenoh
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf.message import Message

from pneuarm import Client
from pneuarm.controllers.arm.errors import DaemonUnreachable
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import full_key
from pneuarm.service.network.sessions import open_connected
from tools.rig.certificates import Authority
from tools.rig.daemon import ROOT, Daemon, wait_for

EXAMPLES = ROOT / "examples" / "network"
NAMES = ("operator", "watcher", "mocap", "stranger")

#: Long enough for what is let through to arrive, many times over.
QUIET_S = 0.5


def placed(example: str, folder: Path, name: str = "operator") -> str:
    """Copy a file of the example, with the certificates where the test has them."""
    text = (EXAMPLES / example).read_text().replace("operator.", f"{name}.")
    for kind in ("pem", "key"):
        for who in ("ca", "robot", *NAMES):
            text = text.replace(f'"{who}.{kind}"', f'"{folder / who}.{kind}"')
    path = folder / f"{name}-{example}"
    path.write_text(text)
    return str(path)


class SecuredDaemon(Daemon):
    """A daemon that is reached with a certificate only."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        authority = Authority(folder)
        for name in ("robot", *NAMES):
            authority.sign(name)
        Authority(folder, "other-ca").sign("operator", "forged")
        zenoh_table = {"config_file": placed("daemon.json5", folder, "robot")}
        feedback = {"tip_pose_source": "mocap"}
        super().__init__(folder, {"zenoh": zenoh_table, "feedback": feedback})
        self.endpoint = self.endpoint.replace("tcp/", "tls/")
        self.config.write_text(self.config.read_text().replace("tcp/", "tls/"))

    def file(self, name: str) -> str:
        return placed("client.json5", self.folder, name)

    def client(self, name: str = "operator") -> Client:
        who = name if name in NAMES else "operator"
        return Client(self.arm, self.endpoint, name, self.file(who))

    def session(self, name: str) -> zenoh.Session:
        return open_connected(self.endpoint, self.file(name))

    def key(self, key: str) -> str:
        return full_key(self.arm, key)


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SecuredDaemon]:
    with SecuredDaemon(tmp_path_factory.mktemp("secured")) as daemon:
        assert isinstance(daemon, SecuredDaemon)
        yield daemon


@pytest.fixture
def operator(daemon: SecuredDaemon) -> Iterator[Client]:
    with daemon.client("operator") as client:
        client.vent()
        wait_for(lambda: client.state().mode == pb.READY, "an empty arm")
        yield client


@contextlib.contextmanager
def rogue(daemon: SecuredDaemon, name: str) -> Iterator[zenoh.Session]:
    session = daemon.session(name)
    try:
        yield session
    finally:
        session.close()


def test_the_operator_moves_the_arm(operator: Client) -> None:
    operator.enable()
    assert operator.move_to((0.0, 0.0, 0.21)).reach == pb.REACHED
    operator.release()


def test_the_watcher_sees_everything(daemon: SecuredDaemon, operator: Client) -> None:
    with daemon.client("watcher") as watcher:
        assert watcher.info().arm == daemon.arm
        assert watcher.past_events().recent
        operator.enable()
        operator.hold()
        wait_for(lambda: "hold" in {event.code for event in watcher.events()}, "the event")
        assert watcher.state().mode == pb.HOLD


@pytest.mark.parametrize("name", ["watcher", "operator"])
def test_a_stop_is_confirmed_to_whoever_may_stop(
    daemon: SecuredDaemon, operator: Client, name: str
) -> None:
    with daemon.client(name) as stopper:
        assert stopper.estop().mode == pb.ESTOP
    operator.reset()


REQUESTS = {
    "enable": pb.ModeRequest(client_id="x", action=pb.ENABLE),
    "hold": pb.ModeRequest(action=pb.HOLD_NOW),
    "vent": pb.ModeRequest(action=pb.VENT),
    "take over": pb.ModeRequest(client_id="x", action=pb.TAKE_LEASE, take_over=True),
}


@pytest.mark.parametrize("key", ["cmd/mode", "cmd/*", "**", "*/mode"])
@pytest.mark.parametrize("request_name", REQUESTS)
@pytest.mark.parametrize("name", ["watcher", "mocap", "stranger"])
def test_others_ask_for_nothing(
    daemon: SecuredDaemon, operator: Client, name: str, request_name: str, key: str
) -> None:
    operator.enable()
    payload = REQUESTS[request_name].SerializeToString()
    with rogue(daemon, name) as session:
        replies = session.get(daemon.key(key), payload=payload, timeout=QUIET_S)
        assert [reply for reply in replies if reply.ok is not None] == []
    assert operator.state().mode == pb.ACTIVE
    assert operator.take_lease().lease_holder == operator.client_id


#: What only the daemon may say, with something that would be believed.
SAYINGS: dict[str, Message] = {
    "state": pb.ArmState(sequence=2**40, mode=pb.ESTOP, n_sections=1),
    "event": pb.Event(code="rogue", text="rogue", source="control", level=pb.ERROR),
    "health": pb.Health(ticks=2**40, lease_holder="rogue"),
    "tip": PoseInFrame(frame_id="rogue"),
}


@pytest.mark.parametrize("key", SAYINGS)
@pytest.mark.parametrize("name", [*NAMES])
def test_nobody_says_what_only_the_daemon_may_say(
    daemon: SecuredDaemon, name: str, key: str
) -> None:
    payload = SAYINGS[key].SerializeToString()
    with rogue(daemon, "watcher") as listening, rogue(daemon, name) as session:
        heard: list[bytes] = []
        subscriber = listening.declare_subscriber(
            daemon.key(key), lambda sample: heard.append(sample.payload.to_bytes())
        )
        if key != "event":
            wait_for(lambda: heard, "what the daemon says")
        until = time.monotonic() + QUIET_S
        while time.monotonic() < until:
            session.put(daemon.key(key), payload)
            session.put(f"pneuarm/{daemon.arm}/{key}", payload)
            time.sleep(0.02)
        assert payload not in heard
        subscriber.undeclare()


ANSWERS: dict[str, Message] = {
    "info": pb.Info(arm="rogue"),
    "state": pb.ArmState(sequence=2**40, mode=pb.ESTOP),
    "events": pb.Events(latched=[pb.Event(text="rogue")]),
    "cmd/mode": pb.Reply(accepted=True, lease_secret="rogue"),
    "cmd/estop": pb.Reply(accepted=True, mode=pb.ESTOP, nonce=b"rogue"),
}


@pytest.mark.parametrize("wildcard", [False, True])
@pytest.mark.parametrize("name", [*NAMES])
def test_nobody_answers_what_only_the_daemon_may_answer(
    daemon: SecuredDaemon, operator: Client, name: str, wildcard: bool
) -> None:
    asked: list[str] = []

    def answer(query: zenoh.Query) -> None:
        asked.append(str(query.key_expr))
        with query, contextlib.suppress(zenoh.ZError):
            message = ANSWERS[str(query.key_expr).split("/", 2)[-1]]
            query.reply(query.key_expr, message.SerializeToString())

    with rogue(daemon, name) as session, rogue(daemon, "operator") as asking:
        keys = [daemon.key("**")] if wildcard else [daemon.key(key) for key in ANSWERS]
        declared = [session.declare_queryable(key, answer, complete=True) for key in keys]
        time.sleep(QUIET_S)
        for key in ANSWERS:
            payload = pb.ModeRequest(action=pb.VENT).SerializeToString()
            answers = list(asking.get(daemon.key(key), payload=payload, timeout=2.0))
            assert [reply.ok is not None for reply in answers] == [True], key
            found = answers[0].ok.payload.to_bytes()
            assert found != ANSWERS[key].SerializeToString(), key
        assert asked == []
        for each in declared:
            each.undeclare()
    operator.reset()


@pytest.mark.parametrize("key", ["cmd/target", "cmd/*", "**", "cmd/estop"])
@pytest.mark.parametrize("name", [*NAMES])
def test_nobody_listens_to_what_others_command(
    daemon: SecuredDaemon, operator: Client, name: str, key: str
) -> None:
    """A target holds the lease's secret."""
    with rogue(daemon, name) as session:
        heard: list[str] = []
        subscriber = session.declare_subscriber(
            daemon.key(key), lambda sample: heard.append(str(sample.key_expr))
        )
        time.sleep(QUIET_S)
        operator.enable()
        operator.move_to((0.0, 0.0, 0.205))
        operator.release()
        assert [key for key in heard if "/cmd/" in key] == []
        subscriber.undeclare()


@pytest.mark.parametrize("key", ["cmd/estop", "cmd/*", "**"])
def test_a_stranger_with_a_certificate_stops_nothing(
    daemon: SecuredDaemon, operator: Client, key: str
) -> None:
    """The stop is for everybody who has a part; a certificate without one has none."""
    operator.enable()
    with rogue(daemon, "stranger") as session:
        session.put(daemon.key(key), b"stop")
        list(session.get(daemon.key(key), payload=b"stop", timeout=QUIET_S))
    assert operator.state().mode == pb.ACTIVE


def test_the_watcher_ends_nobodys_lease(daemon: SecuredDaemon, operator: Client) -> None:
    """A liveliness token of the holder's name that goes would take the lease along."""
    operator.enable()
    with rogue(daemon, "watcher") as session:
        key = daemon.key(f"alive/client/{operator.client_id}")
        session.liveliness().declare_token(key).undeclare()
        time.sleep(QUIET_S)
    assert operator.state().mode == pb.ACTIVE
    assert operator.take_lease().lease_holder == operator.client_id


def pose(x: float) -> bytes:
    message = PoseInFrame(frame_id="base")
    message.pose.position.x, message.pose.position.z = x, 0.2
    message.pose.orientation.w = 1.0
    return message.SerializeToString()


@pytest.mark.parametrize("name", ["operator", "watcher", "stranger"])
def test_only_motion_capture_measures_the_tip(daemon: SecuredDaemon, name: str) -> None:
    with daemon.client("watcher") as watcher, rogue(daemon, name) as session:
        for key in ("sensor/tip_pose", "sensor/tip_pose/mocap", "sensor/tip_pose/other"):
            for _ in range(10):
                session.put(daemon.key(key), pose(0.0471))
                time.sleep(0.02)
        assert 0.0471 not in watcher.state().tip_measured_position_m
        with rogue(daemon, "mocap") as mocap:

            def seen() -> bool:
                mocap.put(daemon.key("sensor/tip_pose/mocap"), pose(0.012))
                return 0.012 in watcher.state().tip_measured_position_m

            wait_for(seen, "the pose of motion capture")


def test_without_a_certificate_of_the_authority_nobody_comes_in(daemon: SecuredDaemon) -> None:
    plain = daemon.endpoint.replace("tls/", "tcp/")
    forged = placed("client.json5", daemon.folder, "forged")
    Path(forged).write_text(
        Path(forged).read_text().replace('"forged.', f'"{daemon.folder / "forged"}.')
    )
    tries: list[Callable[[], Any]] = [
        lambda: open_connected(plain),
        lambda: open_connected(daemon.endpoint),
        lambda: open_connected(daemon.endpoint, forged),
    ]
    for each in tries:
        with pytest.raises(DaemonUnreachable) as caught:
            each()
        assert daemon.endpoint.partition("/")[2] in str(caught.value)
    assert os.path.exists(forged)

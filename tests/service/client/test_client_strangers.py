"""A client among others who claim to be the daemon, and with a daemon newer than itself."""

import contextlib
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import pytest
import zenoh
from google.protobuf.message import Message

from pneuarm import Client
from pneuarm.controllers.arm.errors import DaemonUnreachable, ModeRefused, NotConfirmed
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import decode, encoding_of
from pneuarm.logs.schema.topics import ESTOP, EVENT, INFO, MODE, STATE, full_key
from pneuarm.service.network.sessions import open_connected, open_listening
from tools.rig.daemon import PATIENCE_S, ROOT, Daemon, free_port, wait_for

#: A field that no message of ours has.
NEWER = b"\xfa\x3f\x03new"

STOPPED = pb.ArmState(sequence=7, mode=pb.ESTOP, n_sections=1)


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    with Daemon(tmp_path_factory.mktemp("strangers")) as daemon:
        yield daemon


@contextlib.contextmanager
def answering(session: zenoh.Session, key: str, message: Message) -> Iterator[list[bytes]]:
    """Answer under a key, as anybody may who is on the wire."""
    asked: list[bytes] = []

    def answer(query: zenoh.Query) -> None:
        asked.append(b"" if query.payload is None else query.payload.to_bytes())
        if isinstance(message, pb.Reply):
            message.nonce = asked[-1][:64]
        with query:
            query.reply(query.key_expr, message.SerializeToString())

    declared = session.declare_queryable(key, answer, complete=True)
    time.sleep(0.3)
    yield asked
    declared.undeclare()


@contextlib.contextmanager
def publishing(session: zenoh.Session, key: str, payload: bytes) -> Iterator[None]:
    """Go on publishing under a key."""
    ended = threading.Event()

    def publish() -> None:
        while not ended.wait(0.01):
            session.put(key, payload)

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def test_a_stop_that_somebody_else_confirms_is_not_confirmed() -> None:
    """A router without a daemon behind it: whatever says that the arm has stopped is a lie."""
    endpoint, arm = f"tcp/127.0.0.1:{free_port()}", "paper"
    answer = pb.Reply(accepted=True, mode=pb.ESTOP, state_sequence=7)
    with (
        open_listening([endpoint], ""),
        open_connected(endpoint) as rogue,
        publishing(rogue, full_key(arm, STATE.key), STOPPED.SerializeToString()),
        answering(rogue, full_key(arm, ESTOP.key), answer) as asked,
        Client(arm, endpoint) as client,
    ):
        assert client.state().mode == pb.ESTOP
        with pytest.raises(NotConfirmed, match=r"NOT CONFIRMED.*cut the air supply"):
            client.estop(0.6)
        assert asked  # it was asked, and its answer was passed over


def test_a_stop_is_asked_again_while_answers_are_errors_or_cannot_be_read() -> None:
    endpoint, arm = f"tcp/127.0.0.1:{free_port()}", "paper"
    answers = iter([None, b"\xff", None])

    def answer(query: zenoh.Query) -> None:
        with query:
            payload = next(answers, b"stopped")
            if payload is None:
                query.reply_err("not now")
            elif payload == b"stopped":
                nonce = b"" if query.payload is None else query.payload.to_bytes()
                reply = pb.Reply(accepted=True, mode=pb.ESTOP, state_sequence=7, nonce=nonce)
                query.reply(query.key_expr, reply.SerializeToString())
            else:
                query.reply(query.key_expr, payload)

    with (
        open_listening([endpoint], "") as router,
        publishing(router, full_key(arm, STATE.key), STOPPED.SerializeToString()),
        Client(arm, endpoint) as client,
    ):
        declared = router.declare_queryable(full_key(arm, ESTOP.key), answer, complete=True)
        assert client.estop(PATIENCE_S).mode == pb.ESTOP
        declared.undeclare()


def test_a_stop_gets_through_to_a_daemon_that_comes_back() -> None:
    """The connection is made anew while the stop waits."""
    endpoint, arm = f"tcp/127.0.0.1:{free_port()}", "paper"
    stopped: list[pb.ArmState] = []
    key, state = full_key(arm, STATE.key), STOPPED.SerializeToString()
    with contextlib.ExitStack() as first:
        first.enter_context(
            publishing(first.enter_context(open_listening([endpoint], "")), key, state)
        )
        client = Client(arm, endpoint)
        first.close()
        with client:
            stop = threading.Thread(target=lambda: stopped.append(client.estop(PATIENCE_S)))
            stop.start()
            time.sleep(1.0)
            answer = pb.Reply(accepted=True, mode=pb.ESTOP, state_sequence=7)
            with (
                open_listening([endpoint], "") as router,
                answering(router, full_key(arm, ESTOP.key), answer),
                publishing(router, key, state),
            ):
                stop.join()
    assert [state.mode for state in stopped] == [pb.ESTOP]


def test_false_states_and_answers_stop_nothing_and_confirm_nothing(daemon: Daemon) -> None:
    reply = pb.Reply(accepted=True, mode=pb.ACTIVE, lease_secret="rogue", lease_holder="rogue")
    info = pb.Info(arm="rogue")
    with daemon.client() as client, open_connected(daemon.endpoint) as rogue:
        key = {topic: full_key(daemon.arm, topic.key) for topic in (MODE, INFO, ESTOP)}
        with (
            answering(rogue, key[MODE], reply),
            answering(rogue, key[INFO], info),
            answering(rogue, key[ESTOP], reply),
        ):
            for _ in range(5):
                assert client.info().arm == daemon.arm
                assert client.enable().lease_holder == client.client_id
                assert client.estop().mode == pb.ESTOP
                assert client.reset().mode == pb.IDLE


def test_a_put_alone_stops_too(daemon: Daemon) -> None:
    with daemon.client() as client, open_connected(daemon.endpoint) as other:
        other.put(full_key(daemon.arm, ESTOP.key), b"")
        wait_for(lambda: client.state().mode == pb.ESTOP, "the stop")
        client.reset()


@pytest.mark.parametrize("payload", [b"", b"x" * 64, b"x" * 5000, b"\xff\x00"])
def test_who_asks_by_a_query_is_answered_with_what_was_sent(daemon: Daemon, payload: bytes) -> None:
    with daemon.client() as client, open_connected(daemon.endpoint) as other:
        (reply,) = other.get(full_key(daemon.arm, ESTOP.key), payload=payload, timeout=5.0)
        answer = pb.Reply.FromString(reply.ok.payload.to_bytes())
        assert answer.accepted
        assert answer.mode == pb.ESTOP
        assert answer.nonce == payload[:64]
        assert answer.version
        wait_for(lambda: client.state().mode == pb.ESTOP, "the stop")
        client.reset()


def test_who_looks_for_whatever_there_is_does_not_stop_the_arm(daemon: Daemon) -> None:
    with daemon.client() as client, open_connected(daemon.endpoint) as other:
        wait_for(lambda: client.state().mode == pb.READY, "ready")
        answers = list(other.get(full_key(daemon.arm, "**"), timeout=2.0))
        assert len(answers) >= 5
        assert client.state().mode == pb.READY


@pytest.mark.parametrize("message", [pb.Reply(accepted=True), pb.Info(arm="x"), pb.Event(text="x")])
def test_a_newer_daemon_may_say_more(message: pb.Reply | pb.Info | pb.Event) -> None:
    payload = message.SerializeToString() + NEWER
    read = decode(type(message), payload, encoding_of(message), tolerant=True)
    read.DiscardUnknownFields()
    assert read == message
    text = b'{"fieldToCome": {"a": [1]}}'
    assert decode(type(message), text, "application/json", tolerant=True) == type(message)()


def test_events_of_a_newer_daemon_are_read(daemon: Daemon) -> None:
    with daemon.client() as client, open_connected(daemon.endpoint) as other:
        event = pb.Event(text="from the future", level=77, mode=77).SerializeToString() + NEWER
        other.put(full_key(daemon.arm, EVENT.key), event)
        found: list[pb.Event] = []

        def heard() -> bool:
            found.extend(client.events())
            return any(each.text == "from the future" for each in found)

        wait_for(heard, "the event")


def test_a_refusal_says_which_versions_there_are(
    daemon: Daemon, monkeypatch: pytest.MonkeyPatch
) -> None:
    with daemon.client() as client:
        own = client.info().versions["pneuarm"]
        monkeypatch.setattr("pneuarm.service.client.client.__version__", "99.9")
        with pytest.raises(ModeRefused) as caught:
            client.release()
        assert own in str(caught.value)
        assert "99.9" in str(caught.value)
        monkeypatch.setattr("pneuarm.service.client.client.__version__", own)
        with pytest.raises(ModeRefused) as caught:
            client.release()
        assert own not in str(caught.value)


def test_who_comes_late_learns_why_the_arm_is_stopped(daemon: Daemon) -> None:
    with daemon.client() as client:
        client.estop()
    with daemon.client() as late:
        past = late.past_events()
        assert [event.code for event in past.latched] == ["estop"]
        assert past.latched[0].text in {event.text for event in past.recent}
        done = daemon.command("state")
        assert done.returncode == 0
        lines = done.stdout.splitlines()
        assert len(lines) == 2
        for fact in (past.latched[0].text, past.latched[0].cause, past.latched[0].remedy):
            assert fact in lines[1]
        late.reset()
        wait_for(lambda: not late.past_events().latched, "nothing to be latched")
        assert len(daemon.command("state").stdout.splitlines()) == 1
        json_state = daemon.command("state", "--json").stdout
        assert '"latched_events": []' in json_state


FORKING = """
import os, sys
import zenoh
from pneuarm import Client, PneuarmError
from pneuarm.service.network import sessions
arm, endpoint, opened_by = sys.argv[1:]
if opened_by == "client":
    parents = Client(arm, endpoint)
else:  # a session that pneuarm knows nothing of
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["{endpoint}"]')
    parents = zenoh.open(config)
    sessions._OPEN_S = 1.0
if os.fork() == 0:
    uses = {"new": lambda: Client(arm, endpoint)}
    if opened_by == "client":
        uses |= {
            "state": parents.state,
            "stop": parents.estop,
            "info": parents.info,
            "events": parents.events,
            "past": parents.past_events,
            "enable": parents.enable,
            "target": lambda: parents.send_position((0.0, 0.0, 0.2)),
        }
    for name, use in uses.items():
        try:
            use()
            print(name, "went on")
        except PneuarmError as error:
            print(name, "refused:", error)
    if opened_by == "client":
        parents.close()
    print("end", flush=True)
    os._exit(0)
os.wait()
if opened_by == "client":
    print("parent", parents.state().sequence > 0)
sys.stdout.flush()
os._exit(0)
"""


@pytest.mark.parametrize("opened_by", ["client", "zenoh"])
def test_a_forked_process_is_told_instead_of_hanging(daemon: Daemon, opened_by: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", FORKING, daemon.arm, daemon.endpoint, opened_by],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )
    lines = done.stdout.splitlines()
    refused = [line for line in lines if "refused:" in line]
    assert len(refused) == (8 if opened_by == "client" else 1), done.stdout + done.stderr
    for line in refused:
        assert "fork" in line
        assert "spawn" in line
    assert any(line.startswith("stop refused: NOT CONFIRMED") for line in lines) == (
        opened_by == "client"
    )
    assert "end" in lines
    assert ("parent True" in lines) == (opened_by == "client")


def test_a_daemon_that_does_not_answer_is_no_daemon() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with open_listening([endpoint], ""), pytest.raises(DaemonUnreachable, match="none for arm"):
        Client("paper", endpoint)

"""The stop past the network."""

import contextlib
import os
import select
import socket
import threading

import pytest

from pneuarm.controllers.arm.errors import AlreadyInUse, DaemonUnreachable, NotConfirmed
from pneuarm.service.daemon import local_stop
from pneuarm.service.daemon.local_stop import Callers, listen, stop_locally

NAME = f"test-lock-{os.getpid()}"


class Answering:
    """Stands for the supervisor: takes what comes and answers, or does not."""

    def __init__(self, answer: bytes | None) -> None:
        self.heard: list[bytes] = []
        self._answer = answer
        self._listener = listen(NAME)
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        connection, _ = self._listener.accept()
        with connection:
            self.heard.append(connection.recv(16))
            if self._answer is None:
                self._done.wait(20)
            else:
                connection.sendall(self._answer)

    def end(self) -> None:
        self._done.set()
        self._thread.join(20)
        self._listener.close()


@pytest.fixture(autouse=True)
def _short_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local_stop, "_CONFIRM_S", 0.3)


def test_a_stop_that_acted_is_confirmed() -> None:
    supervisor = Answering(b"stopped\n")
    stop_locally(NAME)
    supervisor.end()
    assert supervisor.heard == [b"estop\n"]


@pytest.mark.parametrize("answer", [b"refused\n", b"", b"stop", None])
def test_anything_else_is_not_confirmed(answer: bytes | None) -> None:
    supervisor = Answering(answer)
    with pytest.raises(NotConfirmed, match=f"^NOT CONFIRMED: .*{NAME}.* cut the air supply$"):
        stop_locally(NAME)
    supervisor.end()


def test_an_arm_has_one_listener() -> None:
    with listen(NAME), pytest.raises(AlreadyInUse, match=NAME):
        listen(NAME)
    listen(NAME).close()


def test_without_a_daemon_on_this_machine_it_says_so() -> None:
    with pytest.raises(DaemonUnreachable, match=f"no daemon for arm '{NAME}' runs") as caught:
        stop_locally(NAME)
    assert not isinstance(caught.value, NotConfirmed)


def test_a_supervisor_that_is_stuck_does_not_hold_up_who_stops() -> None:
    with listen(NAME), pytest.raises(NotConfirmed):  # nobody accepts
        stop_locally(NAME)


def test_a_stuck_supervisor_with_a_full_queue_neither() -> None:
    held = listen(NAME)
    others = []
    for _ in range(20):
        other = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        other.setblocking(False)
        others.append(other)
        if other.connect_ex(f"\0pneuarm/arm/{NAME}"):
            break
    with pytest.raises(NotConfirmed):
        stop_locally(NAME)
    for other in (*others, held):
        other.close()


def test_connections_that_say_nothing_delay_no_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    # A tenth of a second for each of them would be half a minute.
    monkeypatch.setattr(local_stop, "_CONFIRM_S", 10.0)
    with listen(NAME) as listener, contextlib.ExitStack() as silent:
        callers = Callers(listener)
        stopped = threading.Event()

        def serve() -> None:
            while not stopped.is_set():
                readable, _, _ = select.select(callers.sockets(), [], [], 0.02)
                for caller in callers.asking_to_stop(readable):
                    caller.sendall(b"stopped\n")
                    caller.close()

        server = threading.Thread(target=serve)
        server.start()
        for _ in range(300):  # by the hundred: more than may be silent at a time
            other = silent.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
            other.connect(f"\0pneuarm/arm/{NAME}")
        try:
            stop_locally(NAME)
        finally:
            stopped.set()
            server.join(20)
        assert len(callers.sockets()) <= 129


@pytest.mark.parametrize("said", [b"", b"x", b"e", b"GET / HTTP/1.1\r\n\r\n", b"\x00" * 4000])
def test_who_asks_for_something_else_is_sent_away(said: bytes) -> None:
    with listen(NAME) as listener:
        callers = Callers(listener)
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as other:
            other.connect(f"\0pneuarm/arm/{NAME}")
            if said:
                other.sendall(said)
            else:
                other.shutdown(socket.SHUT_WR)
            assert callers.asking_to_stop([listener]) == []
            assert callers.sockets() == [listener]

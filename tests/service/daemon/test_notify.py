"""What the service manager hears: ready with the first tick, alive while there are new ones."""

import os
import signal
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from pneuarm.service.daemon.sd_notify import ServiceManager
from tools.rig.daemon import Daemon, wait_for
from tools.rig.processes import process

_INTERVAL_US = 100_000


class Manager:
    """The service manager's end: a datagram socket, by a path or abstract."""

    def __init__(self, address: str) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind("\0" + address[1:] if address.startswith("@") else address)
        self.socket.setblocking(False)
        self.environment = {"NOTIFY_SOCKET": address, "WATCHDOG_USEC": str(_INTERVAL_US)}

    def read(self) -> list[str]:
        """Return what has been said since the last time."""
        said = []
        try:
            while True:
                said.extend(self.socket.recv(256).decode().split("\n"))
        except BlockingIOError:
            return said


@pytest.fixture(params=["path", "abstract"])
def manager(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Manager]:
    name = f"@pneuarm-test-{os.getpid()}-{time.monotonic_ns()}"
    manager = Manager(name if request.param == "abstract" else str(tmp_path / "notify"))
    yield manager
    manager.socket.close()


def test_ready_once_then_alive_at_a_fifth_of_the_interval_then_stopping_once(
    manager: Manager,
) -> None:
    told = ServiceManager(manager.environment)
    assert manager.environment == {}
    assert manager.read() == []
    told.alive(10.0)
    assert manager.read() == ["READY=1", "WATCHDOG=1"]
    told.alive(10.019)
    assert manager.read() == []
    told.alive(10.021)
    assert manager.read() == ["WATCHDOG=1"]
    told.stopping()
    told.stopping()
    assert manager.read() == ["STOPPING=1"]


def test_a_watchdog_for_another_process_is_not_fed(manager: Manager) -> None:
    told = ServiceManager(manager.environment | {"WATCHDOG_PID": "1"})
    told.alive(10.0)
    manager.read()
    told.alive(20.0)
    assert manager.read() == []


def test_without_a_service_manager_or_with_one_that_is_gone_nothing_happens() -> None:
    for environment in ({}, {"NOTIFY_SOCKET": "@pneuarm-nobody", "WATCHDOG_USEC": "x"}):
        told = ServiceManager(environment)
        told.alive(1.0)
        told.stopping()


def test_a_service_manager_that_does_not_read_is_not_waited_for(manager: Manager) -> None:
    told = ServiceManager(manager.environment)
    for number in range(2000):
        told.alive(float(number))
    assert manager.read()


@pytest.fixture
def heard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Manager]:
    manager = Manager(str(tmp_path / "notify"))
    for name, value in manager.environment.items():
        monkeypatch.setenv(name, value)
    yield manager
    manager.socket.close()


def until(manager: Manager, said: str, number: int = 1) -> list[str]:
    """Collect what is said until something was said often enough."""
    told: list[str] = []

    def enough() -> bool:
        told.extend(manager.read())
        return told.count(said) >= number

    wait_for(enough, lambda: f"{number} times {said} from the daemon; it said {told}")
    return told


def test_a_daemon_is_ready_with_its_first_tick_and_says_that_it_stops(
    tmp_path: Path, heard: Manager
) -> None:
    daemon = Daemon(tmp_path)
    try:
        daemon.launch()
        told = until(heard, "WATCHDOG=1", 5)
        assert told.count("READY=1") == 1
        assert set(told) == {"READY=1", "WATCHDOG=1"}
        assert "real" in daemon.output()  # which is said after the first tick
        daemon.stop()
        told = heard.read()
        assert told.count("STOPPING=1") == 1
        assert told[-1] == "STOPPING=1"
    finally:
        daemon.kill()


def test_the_watchdog_is_fed_by_ticks_alone(tmp_path: Path, heard: Manager) -> None:
    """The supervisor runs on, and still the sign of life ends with the loop that it stands for."""
    with Daemon(tmp_path) as daemon:
        until(heard, "WATCHDOG=1", 5)
        control = daemon.pids("control")["control"]
        daemon.send_signal_to(control, signal.SIGSTOP)
        wait_for(lambda: process(control).state == "T", "the stop")
        heard.read()
        told = until(heard, "STOPPING=1")
        # At most one tick was still to be seen; fed by the supervisor's turns it would be five.
        assert told.count("WATCHDOG=1") <= 1
        assert daemon.wait() == 3
        assert heard.read() == []

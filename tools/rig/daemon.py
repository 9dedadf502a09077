"""A real daemon for the tests: `python -m pneuarm run` on free ports, in its own process group.

Every daemon has its own arm's name, device, ports and log directory, so that the tests run beside
other daemons, and beside each other.
"""

import contextlib
import itertools
import math
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import pytest
import tomli_w

from pneuarm import Client
from pneuarm.controllers.arm.errors import DaemonUnreachable, PneuarmError
from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import HEALTH
from tools.rig.processes import process, processes

ROOT = Path(__file__).resolve().parents[2]

#: After so long without what is waited for, something hangs. No test passes or fails by how fast
#: the machine is, so it is many times what a busy one needs; what has died is told at once.
PATIENCE_S = 120.0

#: A start that gets no further for so long hangs.
STANDSTILL_S = 60.0

#: The recorder writes every 0.4 s; an event may be what explains why a test failed.
_FLUSHED_S = 1.0

_numbers = itertools.count(1)
T = TypeVar("T")


def wait_for(
    condition: Callable[[], T], what: str | Callable[[], str], patience_s: float = PATIENCE_S
) -> T:
    """Return the first true value of a condition; fails with what was waited for."""
    give_up_s = time.monotonic() + patience_s
    while not (value := condition()):
        if time.monotonic() > give_up_s:
            told = what if isinstance(what, str) else what()
            pytest.fail(f"waited {patience_s:g} s in vain for: {told}")
        time.sleep(0.01)
    return value


def free_port() -> int:
    """Return a port of loopback that nobody uses now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def run_command(*arguments: str, **options: Any) -> "subprocess.CompletedProcess[str]":
    """Run `pneuarm ARGUMENTS` to its end."""
    return subprocess.run(
        [sys.executable, "-m", "pneuarm", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        **({"timeout": PATIENCE_S} | options),
    )


def assert_one_sentence(done: "subprocess.CompletedProcess[str]", *words: str) -> None:
    """Check a failed command: status 1, or 2 for its usage; one line on stderr with all words."""
    assert done.returncode in (1, 2), (done.returncode, done.stdout, done.stderr)
    assert done.stderr.startswith("pneuarm: "), done.stderr
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert done.stdout == ""
    for word in words:
        assert word in done.stderr


class Daemon:
    """One daemon process with its children."""

    #: Every daemon that was started in this process.
    launched: "ClassVar[list[Daemon]]" = []

    def __init__(self, folder: Path, tables: dict[str, dict[str, Any]] | None = None) -> None:
        """Write the configuration: small and without the live view, but for ``tables``."""
        number = next(_numbers)
        self.arm = f"test-{os.getpid()}-{number}"
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.rerun_port = free_port()
        self.logs = folder / "sessions"
        self.config = folder / f"daemon-{number}.toml"
        self._output = folder / f"daemon-{number}.txt"
        own: dict[str, dict[str, Any]] = {
            "arm": {"name": self.arm},
            # A test that is late on a busy machine is no hanging client.
            "control": {"target_timeout_ms": 5000},
            "zenoh": {"listen": [self.endpoint]},
            "rerun": {"enabled": False, "port": self.rerun_port},
            "log": {"directory": str(self.logs), "min_free_mib": 1},
        }
        for name, table in (tables or {}).items():
            own[name] = own.get(name, {}) | table
        self.config.write_text(tomli_w.dumps(own))
        self.process: subprocess.Popen[bytes] | None = None
        self._names: dict[int, str] = {}
        self._broken_ns: dict[str, int] = {}

    def start(self) -> "Daemon":
        """Start it and wait until it answers and the arm is ready."""
        self.launch()
        try:
            self.wait_until_it_answers()
        except BaseException:
            self.kill()
            raise
        return self

    def wait_until_it_answers(self) -> None:
        """Wait for the end of the start for as long as it gets further."""
        reached, moved_s = self._reached(), time.monotonic()
        while not self._answers():
            now_s, further = time.monotonic(), self._reached()
            if further != reached:
                reached, moved_s = further, now_s
            elif now_s - moved_s > STANDSTILL_S:
                pytest.fail(f"the daemon's start stands still; it said: {self.output()}")
            time.sleep(0.05)

    def _reached(self) -> object:
        """Say how far the start is: what was said, who runs, how much is recorded."""
        sizes = {path.name: path.stat().st_size for path in self.logs.glob("*.mcap")}
        return len(self.output()), tuple(self._running()), tuple(sizes.items())

    def launch(self) -> None:
        """Start the process."""
        self.launched.append(self)
        with self._output.open("ab") as output:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "pneuarm", "run", str(self.config)],
                cwd=ROOT,
                stdout=output,
                stderr=subprocess.STDOUT,
                process_group=0,
            )

    def _answers(self) -> bool:
        assert self.process is not None
        assert self.process.poll() is None, f"the daemon ended: {self.output()}"
        try:
            with self.client("start") as client:
                log = Path(client.info().log_path)
                recording = log.exists() and log.stat().st_size > 0
                return recording and client.state().mode == pb.READY
        except DaemonUnreachable:
            return False

    def client(self, name: str = "test") -> Client:
        """Return a new client of this daemon; to be closed."""
        return Client(self.arm, self.endpoint, name)

    def command(self, *arguments: str) -> "subprocess.CompletedProcess[str]":
        """Run one of the client's commands against this daemon."""
        return run_command(*arguments, "--arm", self.arm, "--connect", self.endpoint)

    def output(self) -> str:
        """Return what the daemon has said so far."""
        return self._output.read_text()

    @property
    def pid(self) -> int:
        """Process number of the supervisor, which is the number of the group too."""
        assert self.process is not None
        return self.process.pid

    def pids(self, *names: str) -> dict[str, int]:
        """Return process numbers by name, as `health` tells them, once all names are there."""

        def found(client: Client) -> dict[str, int]:
            rows = {row.name: row.pid for row in health_of(client).processes}
            # `health` is up to a second old, and these get signals: they must be ours, and alive.
            ours = all(name in rows and self._owns(rows[name]) for name in names)
            return rows if ours else {}

        with self.client("pids") as client:
            pids = wait_for(lambda: found(client), f"processes {names} in health")
        self._names |= {pid: name for name, pid in pids.items()}
        return pids

    def health(self) -> pb.Health:
        """Return the newest `health`."""
        with self.client("health") as client:
            return health_of(client)

    def send_signal(self, number: int) -> None:
        """Send a signal to the supervisor alone."""
        os.kill(self.pid, number)

    def send_signal_to(self, pid: int, number: int) -> None:
        """Send a signal to one of the processes that :meth:`pids` has named: it is broken by it."""
        self.breaks(self._names[pid])
        os.kill(pid, number)

    @contextlib.contextmanager
    def standing_still(self, pid: int) -> Iterator[None]:
        """Let one of the processes that :meth:`pids` has named stand still meanwhile."""
        self.send_signal_to(pid, signal.SIGSTOP)
        try:
            yield
        finally:
            self.send_signal_to(pid, signal.SIGCONT)

    def send_signal_to_all(self, number: int) -> None:
        """Send a signal to the whole group, as a terminal does."""
        self.breaks("control", "device", "gateway")
        os.killpg(self.pid, number)

    def breaks(self, *parts: str) -> None:
        """Note that the test breaks something: a process, or the ``client`` that falls silent."""
        for part in parts:
            self._broken_ns.setdefault(part, time.time_ns())

    def forget_what_was_broken(self) -> None:
        """Begin another test."""
        self._broken_ns.clear()

    def lost_control(self, since_ns: int) -> bool:
        """Say whether it has ended since a time (UTC) as one does whose control came too late."""
        ended = self.process is not None and self.process.poll() == 3
        late = ended and self._output.stat().st_mtime_ns >= since_ns
        return late and not self.broke("control", time.time_ns())

    def broke(self, part: str, time_ns: int) -> bool:
        """Say whether the test had broken something before a time (UTC)."""
        return self._broken_ns.get(part, time_ns) < time_ns

    def wait(self) -> int:
        """Wait for the end of the supervisor and of all its children; return its status."""
        assert self.process is not None
        wait_for(lambda: self.process and self.process.poll() is not None, self._what)
        wait_for(lambda: not self._running(), self._what)
        return self.process.returncode

    def _what(self) -> str:
        """Say who is still there, for a test that waited in vain for the end."""
        return f"the end of processes {self._running()}; the daemon said: {self.output()}"

    def _owns(self, pid: int) -> bool:
        """Say whether a process is of this daemon's group, or a child of one that is."""
        running = self._running()
        try:
            return pid in running or process(pid).parent in running
        except OSError:
            return False

    def stop(self) -> None:
        """End it as it should end: SIGTERM, status 0, nothing left behind, no traceback."""
        if self.process is not None and self.process.poll() is None:
            self.send_signal(signal.SIGTERM)
            assert self.wait() == 0, self.output()
            assert "Traceback" not in self.output(), self.output()

    def kill(self) -> None:
        """Make sure that nothing of it is left; what it has told until now stands in its log."""
        if self.process is not None and self._running():
            time.sleep(_FLUSHED_S)
            os.killpg(self.pid, signal.SIGKILL)
            self.wait()

    def _running(self) -> list[int]:
        """Return the living processes of the group; a zombie does not count."""
        return [each.pid for each in processes() if each.group == self.pid and each.state != "Z"]

    def log_path(self) -> Path:
        """First part of the newest session; raises ValueError where there is none."""
        return max(path for path in self.logs.glob("*.mcap") if "." not in path.stem)

    def log(self) -> LogReader:
        """Open the newest session."""
        return LogReader(self.log_path())

    def events(self) -> list[pb.Event]:
        """Return the events that the newest session holds, in the order of their time."""
        found = [entry.message for entry in self.log() if isinstance(entry.message, pb.Event)]
        return sorted(found, key=lambda event: event.time_unix_ns)

    def codes(self) -> list[str]:
        """Return the codes of the events in the newest session."""
        return [event.code for event in self.events()]

    def __enter__(self) -> "Daemon":
        """Start."""
        return self.start()

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        """End it well, unless the test has failed already."""
        try:
            if kind is None:
                self.stop()
        finally:
            self.kill()


def wait_for_event(client: Client, code: str) -> None:
    """Wait until the client hears of an event: it may come after the state that shows its cause."""
    wait_for(lambda: code in {event.code for event in client.events()}, f"the event {code}")


def arm(client: Client) -> None:
    """Take the lease and arm; an arm that is still active from before stays so."""

    def armed() -> bool:
        try:
            active = client.state().mode == pb.ACTIVE
            reply = client.take_lease() if active else client.enable()
        except PneuarmError:
            return False
        return reply.mode == pb.ACTIVE

    wait_for(armed, "the arm to be active")


def keep_moving(client: Client, until: Callable[[], T], what: str) -> T:
    """Refresh a target, a slow circle, until something is true; the arm is active all the time."""

    def moved() -> T:
        turn = 2.0 * math.pi * (time.monotonic() % 4.0) / 4.0
        client.send_position((0.03 * math.cos(turn), 0.03 * math.sin(turn), 0.2))
        assert client.state().mode == pb.ACTIVE, client.events()
        return until()

    return wait_for(moved, what)


def has_air(client: Client, least_pa: float) -> Callable[[], bool]:
    """Return a condition that is true while a chamber is sent more than some pressure."""
    return lambda: max(abs(p) for p in client.state().pressure_sent_pa) > least_pa


def enough(seconds: float) -> Callable[[], bool]:
    """Return a condition that is true after some seconds, for what is to go on for a while."""
    until_s = time.monotonic() + seconds
    return lambda: time.monotonic() > until_s


def health_of(client: Client) -> pb.Health:
    """Ask for the newest `health`."""
    return client._query(HEALTH, pb.ModeRequest(), pb.Health())

"""A daemon for an hour: does the memory of a process grow, is a tick lost, is a handle kept?

    python -m tools.soak --minutes 60

At 1 kHz with feedback by a camera, a live view, a program that moves the arm, one that reads every
state, and one that takes a core of the machine. The exit status is 1 where a tick is missing, an
event tells of a fault or of a process that was started again, or a process grows: by more than 1 MB
in an hour after the first minute, by a handle or by a thread. Rerun's own server is told and not
judged: it keeps what the view shows.
"""

import argparse
import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from pneuarm.logs.schema import pneuarm_pb2 as pb
from tools.faults.program import Program
from tools.rig.daemon import Daemon, run_command, wait_for
from tools.rig.processes import own_memory_bytes

#: After this a process has loaded and touched what it needs, s.
_SETTLED_S = 60.0
_MOST_MB_AN_HOUR = 1.0
_FOREIGN = "rerun"


class Use(NamedTuple):
    """What a process holds: its own memory (MB), file handles, threads."""

    memory_mb: float
    handles: int
    threads: int

    @classmethod
    def of(cls, pid: int) -> "Use":
        """Read it."""
        handles, threads = (len(os.listdir(f"/proc/{pid}/{what}")) for what in ("fd", "task"))
        return cls(own_memory_bytes(pid) / 2**20, handles, threads)


def main() -> int:
    """Run it; 1 if anything grew or was lost."""
    parser = argparse.ArgumentParser(prog="python -m tools.soak", description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    minutes: float = parser.parse_args().minutes
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # leave no process behind
    with tempfile.TemporaryDirectory(prefix="pneuarm-soak-") as folder:
        tables = {"rerun": {"enabled": True}, "feedback": {"enabled": True}}
        daemon = Daemon(Path(folder), tables)
        with daemon, _company(daemon), _told(daemon) as told:
            uses = list(_watch(daemon, minutes))
        log = str(daemon.log_path())
        facts = json.loads(run_command("info", log, "--json", timeout=900.0).stdout)
    _print(uses, facts)
    grown = [line for name in uses[0][1] if name != _FOREIGN for line in _growth(name, uses)]
    faults = [f"{event.code}: {event.text}" for event in told if _is_fault(event)]
    lost = [f"{facts['missing_ticks']} ticks are missing"] if facts["missing_ticks"] else []
    for line in (*grown, *faults, *lost):
        print(f"BROKEN  {line}")
    return int(bool(grown or faults or lost))


def _is_fault(event: pb.Event) -> bool:
    return event.level == pb.ERROR or event.code.endswith("_restarted")


@contextlib.contextmanager
def _company(daemon: Daemon) -> Iterator[None]:
    """Move the arm, see its tip, read its states, and keep a core busy."""
    where = (daemon.arm, daemon.endpoint)
    programs = [
        Program("tools.faults.mover", *where, "mover"),
        Program("tools.faults.liar", *where, "camera"),
    ]
    busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    ends = threading.Event()
    panel = threading.Thread(target=_read_states, args=(daemon, ends))
    try:
        programs[1].hear("here")
        programs[1].ask("see 100", "does")
        programs[0].ask("go", "moves")
        panel.start()
        yield
    finally:
        ends.set()
        busy.kill()
        busy.wait()
        for program in programs:
            program.kill()
        panel.join()


def _read_states(daemon: Daemon, ends: threading.Event) -> None:
    with daemon.client("panel") as client:
        for _ in client.states():
            if ends.is_set():
                return


@contextlib.contextmanager
def _told(daemon: Daemon) -> Iterator[list[pb.Event]]:
    """Collect what the daemon tells until the end."""
    found: list[pb.Event] = []
    ends = threading.Event()

    def listen() -> None:
        with daemon.client("listener") as client:
            while not ends.wait(0.5):
                found.extend(client.events())

    listener = threading.Thread(target=listen)
    listener.start()
    try:
        yield found
    finally:
        ends.set()
        listener.join()


def _watch(daemon: Daemon, minutes: float) -> Iterator[tuple[float, dict[str, Use]]]:
    """Yield the time and what every process holds, once a minute after the first."""
    begun_s = time.monotonic()
    wait_for(lambda: time.monotonic() - begun_s > _SETTLED_S, "the first minute", 2 * _SETTLED_S)
    while (now_s := time.monotonic() - begun_s) <= 60.0 * minutes + 1.0:
        health = daemon.health()
        pids = daemon.pids("supervisor", "control", "gateway", "recorder", "viewer", "rerun")
        uses = {name: Use.of(pid) for name, pid in pids.items()}
        print(
            f"{now_s / 60.0:5.1f} min, {health.rate_hz:.1f} Hz, {health.overruns} overruns: "
            + ", ".join(f"{name} {use.memory_mb:.2f} MB" for name, use in uses.items()),
            flush=True,
        )
        yield now_s, uses
        time.sleep(min(60.0, max(0.0, 60.0 * minutes - now_s) + 1.0))


def _growth(name: str, uses: list[tuple[float, dict[str, Use]]]) -> Iterator[str]:
    """Say by what a process has grown."""
    (first_s, first), (last_s, last) = uses[0], uses[-1]
    hours = max(last_s - first_s, 1.0) / 3600.0
    grown_mb = last[name].memory_mb - first[name].memory_mb
    if grown_mb > _MOST_MB_AN_HOUR * max(hours, 1.0):
        yield f"{name} grew by {grown_mb:.2f} MB in {60.0 * hours:.0f} minutes"
    if last[name].handles > first[name].handles:
        yield f"{name} holds {last[name].handles} handles, and {first[name].handles} before"
    if last[name].threads > first[name].threads:
        yield f"{name} has {last[name].threads} threads, and {first[name].threads} before"


def _print(uses: list[tuple[float, dict[str, Use]]], facts: dict[str, object]) -> None:
    """Print the table: every process at the first and at the last look."""
    print("\n| process | memory MB | handles | threads |\n|---|---|---|---|")
    for name, first in uses[0][1].items():
        last = uses[-1][1][name]
        pairs = zip(first, last, strict=True)
        print(f"| {name} | " + " | ".join(f"{a:.5g} -> {b:.5g}" for a, b in pairs) + " |")
    print({key: value for key, value in facts.items() if isinstance(value, (int, float, bool))})


if __name__ == "__main__":
    sys.exit(main())

"""A daemon, a program that moves its arm, and somebody who watches and stops it."""

import contextlib
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

import pytest

from pneuarm import Client
from pneuarm.controllers.arm.errors import PneuarmError
from pneuarm.hardware.simulator.parameters import Valves
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.configuration import load
from tools.faults.emulator import EMPTY_PA, Emulator
from tools.faults.injection import Injection
from tools.faults.program import Program
from tools.rig.daemon import Daemon, health_of, wait_for
from tools.rig.processes import own_memory_bytes

T = TypeVar("T")

#: After its daemon has ended an emulated arm is given so long to lose its air, s, by its valves.
_EMPTIES_S: dict[Valves, float] = {"servo": 1.0, "itv": 6.0, "onoff": 3.0}

#: Small and quick: the target's timeout is the daemon's own, a full disk vents soon.
TABLES: dict[str, dict[str, Any]] = {
    "control": {"target_timeout_ms": 200},
    "log": {"full_disk_vent_s": 1.0},
}


class Rig:
    """What one fault is injected into; a context manager that leaves no process behind."""

    def __init__(
        self, tables: dict[str, dict[str, Any]], device: str = "simulator", valves: Valves = "servo"
    ) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="pneuarm-faults-")
        folder = Path(self._folder.name)
        self.emulator = None if device == "simulator" else Emulator(device, folder, valves)
        device_tables = {} if self.emulator is None else self.emulator.tables
        own: dict[str, dict[str, Any]] = {"simulator": {"valves": valves}}
        self._empties_s = _EMPTIES_S[valves]
        for part in (TABLES, device_tables, tables):
            for name, table in part.items():
                own[name] = own.get(name, {}) | table
        self.daemon = Daemon(folder, own)
        self._programs: list[Program] = []
        self._watcher: Client | None = None
        self._mover: Program | None = None
        self._beside: dict[str, Program] = {}
        self._air_pa = 0.0

    def __enter__(self) -> "Rig":
        """Start everything."""
        try:
            #: Between the time of the log and the monotonic clock, before anybody sets a clock.
            self.offset_ns = time.time_ns() - time.monotonic_ns()
            self._start()
            self._watcher = self.daemon.client("watcher")
        except BaseException:
            self.close()
            raise
        return self

    def _start(self) -> None:
        """Start the daemon; a machine with much else to do may take its time."""
        self.daemon.launch()
        self.daemon.wait_until_it_answers()
        highest_pa = load(self.daemon.config).build_arm().per_chamber("pressure_max_pa").max()
        self._air_pa = max(2.5 * EMPTY_PA, 0.08 * highest_pa)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End everything, well or not."""
        self.close()

    def close(self) -> None:
        """End everything at once, and take the files away."""
        self.end_programs()
        with contextlib.suppress(Exception):
            self.daemon.kill()
        if self.emulator is not None:
            self.emulator.kill()
        self._folder.cleanup()

    def end_programs(self) -> None:
        """End all but the daemon."""
        if self._watcher is not None:
            self._watcher._session.close()
            self._watcher = None
        while self._programs:
            self._programs.pop().kill()
        self._mover = None
        self._beside.clear()

    # --- who takes part ----------------------------------------------------------------------

    @property
    def watcher(self) -> Client:
        """A client that only looks, and stops."""
        assert self._watcher is not None
        return self._watcher

    def program(self, module: str, *arguments: str) -> Program:
        """Start a program that is ended with this rig."""
        program = Program(module, *arguments)
        self._programs.append(program)
        return program

    def new_mover(self, name: str = "mover") -> Program:
        """Start a program that can move the arm."""
        module = "tools.faults.mover"
        return self.program(module, self.daemon.arm, self.daemon.endpoint, name)

    @property
    def mover(self) -> Program:
        """The program that moves the arm."""
        if self._mover is None:
            self._mover = self.new_mover()
            self._mover.hear("here")
        return self._mover

    def replace_mover(self) -> None:
        """Forget the one that was killed."""
        if self._mover is not None:
            self._mover.kill()
            self._programs.remove(self._mover)
            self._mover = None

    def has_beside(self, name: str) -> bool:
        """Whether such a program runs already."""
        return name in self._beside

    def beside(self, name: str, module: str = "tools.faults.mover") -> Program:
        """Return a program that stays with this rig: a second client, or the fuzzer."""
        if name not in self._beside:
            names = () if module.endswith("fuzz") else (name,)
            program = self.program(module, self.daemon.arm, self.daemon.endpoint, *names)
            program.hear("here")
            self._beside[name] = program
        return self._beside[name]

    def health(self) -> pb.Health:
        """Return a health that is new: the one that is asked for may be a second old."""
        old = health_of(self.watcher).time_unix_ns

        def new() -> pb.Health | None:
            health = health_of(self.watcher)
            return health if health.time_unix_ns != old else None

        return self.wait_until(new, "a new health", 5.0)

    def ending(self) -> bool:
        """Whether control is gone, and the daemon with it."""
        try:
            return self.watcher.state(timeout_s=1.0) is None
        except PneuarmError:
            return True

    def pid(self, name: str) -> int:
        """Return the process number of one of the daemon's processes, as health tells it now."""

        def found() -> int:
            rows = {row.name: row.pid for row in health_of(self.watcher).processes}
            pid = rows.get(name, 0)
            return pid if pid and self.daemon._owns(pid) else 0

        return wait_for(found, f"process {name} in health")

    # --- what the arm does -------------------------------------------------------------------

    @property
    def mode(self) -> int:
        """The arm's mode now."""
        return self.watcher.state().mode

    def wait_for_mode(self, *modes: int, patience_s: float = 10.0) -> int:
        """Wait until the arm is in one of these modes, though the gateway may be away for long."""
        names = " or ".join(pb.Mode.Name(mode) for mode in modes)
        return self.wait_until(lambda: self.mode in modes and self.mode, names, patience_s)

    def wait_until(
        self, condition: Callable[[], T | None], what: str, patience_s: float = 10.0
    ) -> T:
        """Wait for something that may be unreachable in between."""

        def tried() -> T | None:
            with contextlib.suppress(PneuarmError):
                return condition()
            return None

        value = wait_for(tried, what, patience_s)
        assert value is not None
        return value

    def wait_s(self, seconds: float) -> None:
        """Let the arm move for a while, active all the time."""
        time.sleep(seconds)
        self.move()

    def move(self) -> None:
        """Let the arm move, with air in it; one that moves already goes on."""
        if self._watcher is None:
            self._watcher = self.daemon.client("watcher")

        def has_air() -> bool:
            state = self.watcher.state()
            if state.mode != pb.ACTIVE:
                self.mover.ask("go", "moves")
            largest_pa = max((abs(p) for p in state.pressure_sent_pa), default=0.0)
            return largest_pa > self._air_pa

        self.wait_until(has_air, "air in a moving arm", 20.0)

    def stop_and_reset(self, injection: Injection) -> None:
        """After a fault: the stop still works, nothing stays in the arm, and it can be reset."""
        try:
            self.watcher.estop()
        except PneuarmError as error:
            injection.check("the stop works afterwards", False, str(error))
        else:
            injection.check("the stop works afterwards", True)
        self.wait_for_mode(pb.ESTOP)
        time.sleep(0.05)  # a stop and a reset may overtake each other on the way
        self.wait_until(self._is_reset, "READY after a reset", 15.0)
        self.move()
        injection.check("reset and enable arm again", self.mode == pb.ACTIVE)

    def wait_until_empty(self) -> None:
        """Wait for the air to go out of an emulated arm; what stays in it the record shows."""
        if self.emulator is not None:
            with contextlib.suppress(pytest.fail.Exception):
                wait_for(self.emulator.is_empty, "an empty arm", self._empties_s)

    def _is_reset(self) -> bool:
        """Reset as often as it takes: a device that is away must come back first."""
        mode = self.mode
        if mode in (pb.ESTOP, pb.FAULT):
            self.watcher.reset()
            time.sleep(0.1)
        return mode == pb.READY

    @property
    def alive(self) -> bool:
        """Whether the daemon runs."""
        process = self.daemon.process
        return process is not None and process.poll() is None

    def wait_for_end(self, injection: Injection, *statuses: int) -> None:
        """Wait until the daemon and all its processes are gone."""
        self.end_programs()
        status = self.daemon.wait()
        self.wait_until_empty()
        injection.check("exit status", status in statuses, f"{status} instead of {statuses}")
        self.check_said(injection)
        leftover = [path for path in Path("/dev/shm").glob("*") if self.daemon.arm in path.name]
        injection.check("nothing is left behind", not self.daemon._running() and not leftover)

    def check_said(self, injection: Injection) -> None:
        """A daemon never shows a traceback."""
        said = self.daemon.output()
        injection.check("no traceback", "Traceback" not in said, said[-2000:])

    def last_words(self) -> str:
        """What the daemon has said last, for whoever looks for the cause."""
        newest = self._watcher._newest if self._watcher is not None else None
        lines = [] if newest is None else [f"mode {pb.Mode.Name(newest.mode)}"]
        with contextlib.suppress(OSError):
            lines += self.daemon.output().splitlines()[-6:]
        return "".join(f"\n    {line}" for line in lines)

    def memory_bytes(self, name: str) -> int:
        """Own memory of one of the daemon's processes."""
        return own_memory_bytes(self.pid(name))

"""Runs the injections: one daemon for as many as it survives, a new one where it does not."""

import contextlib
import random
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.simulator.parameters import Valves
from pneuarm.service.configuration.configuration import load
from tools.faults.clock import settable_clock
from tools.faults.device_audit import audit_device
from tools.faults.fault import Fault, Row
from tools.faults.injection import Injection
from tools.faults.log_audit import audit_log
from tools.faults.rig import Rig

#: How long an arm has moved at most when the fault comes, s.
_MOVES_S = 0.5

_FAILED = (Exception, pytest.fail.Exception)


def tell(text: str, end: str = "\n") -> None:
    """Say how far it is."""
    print(text, end=end, file=sys.stderr, flush=True)


class FaultRun:
    """All injections of one fault; what has been done when it is interrupted is kept."""

    def __init__(self, fault: Fault, times: int, seed: int, valves: Valves) -> None:
        self.row = Row(fault, unable=fault.unable())
        self._fault, self._seeds, self._valves = fault, range(seed, seed + times), valves
        self._unaudited: list[Injection] = []
        self._rig: Rig | None = None
        self._open = ExitStack()

    def run(self) -> None:
        """Inject as often as asked; always ends every process."""
        if self.row.unable:
            return
        try:
            for seed in self._seeds:
                self._inject_once(seed)
            self._end_well()
        except KeyboardInterrupt:
            self._end_well()
            raise
        finally:
            self._open.close()

    def _inject_once(self, seed: int) -> None:
        injection = Injection(self._fault.name, seed, random.Random(seed))
        try:
            rig = self._moving_rig()
            rig.wait_s(injection.random.uniform(0.0, _MOVES_S))
            self.row.injections.append(injection)
            self._unaudited.append(injection)
            self._fault.inject(rig, injection)
            if rig.alive:
                rig.stop_and_reset(injection)
        except KeyboardInterrupt:  # half an injection proves nothing
            self.row.injections = [i for i in self.row.injections if i is not injection]
            self._unaudited = [i for i in self._unaudited if i is not injection]
            raise
        except _FAILED as error:
            if injection not in self.row.injections:
                self.row.injections.append(injection)
            said = self._rig.last_words() if self._rig is not None else ""
            injection.check("the policy", False, f"{type(error).__name__}: {error}{said}")
            self._end_badly()
        injection.end()
        tell("!" if injection.broken else ".", end="")
        if self._rig is not None and not self._rig.alive:
            self._close()

    def _moving_rig(self) -> Rig:
        """Return a daemon with a moving arm: the one before, or a new one."""
        if self._rig is None:
            if self._fault.clock:
                folder = self._open.enter_context(tempfile.TemporaryDirectory())
                self._open.enter_context(settable_clock(Path(folder)))
            self._rig = self._open.enter_context(
                Rig(self._fault.tables, self._fault.device, self._valves)
            )
        self._rig.move()
        return self._rig

    def _end_well(self) -> None:
        """End the daemon as it should end, and read its log."""
        if self._rig is None:
            return
        last = self._unaudited[-1] if self._unaudited else Injection("", 0, random.Random(0))
        try:
            self._rig.end_programs()
            self._rig.daemon.stop()
        except _FAILED as error:
            tell(f"\n{error}")
            last.check("the end", False, str(error))
        self._close()

    def _end_badly(self) -> None:
        """After something that should not be: look at the log all the same, with no daemon left."""
        if self._rig is not None:
            self._rig.end_programs()
            with contextlib.suppress(*_FAILED):
                self._rig.daemon.kill()
            self._close()

    def _close(self) -> None:
        """Judge all injections of this daemon by its log, and take its files away."""
        rig, self._rig = self._rig, None
        assert rig is not None
        if self._unaudited:
            arm = load(rig.daemon.config).build_arm()
            self._audit(rig, arm)
        self._unaudited = []
        self._open.close()

    def _audit(self, rig: Rig, arm: Arm) -> None:
        path = rig.daemon.log_path()
        audit_log(path, rig.offset_ns, arm, self._unaudited, rig.emulator is not None)
        if rig.emulator is not None:
            audit_device(rig.emulator.record, arm, self._unaudited, rig.emulator.jitter_s)


def run_campaign(
    faults: list[Fault], times: int, seed: int, valves: Valves = "servo"
) -> Iterator[Row]:
    """Run fault after fault; yields every row as it is done, the interrupted one too."""
    for fault in faults:
        tell(f"{fault.name:40} ", end="")
        begin_s = time.monotonic()
        run = FaultRun(fault, times, seed, valves)
        try:
            run.run()
        finally:
            tell(f" {run.row.unable or f'{time.monotonic() - begin_s:.0f} s'}")
            yield run.row

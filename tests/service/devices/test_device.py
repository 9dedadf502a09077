"""The device process, step by step, against an emulated terminal on its real transport."""

import multiprocessing
import re
import time
from collections.abc import Iterator
from contextlib import suppress
from threading import Thread

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.festo_cpx.emulator import EmulatedCpx
from pneuarm.hardware.festo_cpx.protocol import CpxLayout
from pneuarm.hardware.guard import Guard
from pneuarm.hardware.transports.modbus_server import ServedTerminal
from pneuarm.service.configuration.configuration import Configuration, check, load
from pneuarm.service.devices.process import WARM_UP_COMMANDS, DeviceProcess
from pneuarm.service.processes.device_slots import (
    SILENT_S,
    DeviceLink,
    DeviceWatch,
    LinkedDevice,
    LinkState,
)
from tests.hardware.festo.festo_bench import WATCHDOG

SOME_PA = np.array([[2e4, -1e4, 1e4]])
ZEROS = np.zeros((1, 3))
MAX_AGE_S = 0.3
#: Likewise: half of the terminal's watchdog would be too short for a test machine.
GAP_MAX_S = 0.25


def configuration_for(port: int) -> Configuration:
    tables = load(None, "paper").model_dump()
    tables["hardware"] = {"adapter": "festo-cpx"}
    tables["festo_cpx"] = {"host": "127.0.0.1", "port": port, "valve_range": "vacuum"}
    tables["festo_cpx"] |= {"timeout_ms": 150.0, "watchdog_ms": 400}
    return check(tables)


class Terminal(EmulatedCpx):
    """A terminal that counts what it is asked."""

    def __init__(self, arm: EmulatedArm) -> None:
        super().__init__(arm, CpxLayout((0, 1, 2)), WATCHDOG)
        self.asked = 0
        self.calls: list[str] = []
        self.written: list[list[int]] = []

    def read(self, address: int, count: int) -> list[int] | None:
        if address != WATCHDOG.register:  # which is looked at once a second
            self.calls.append("read")
        return super().read(address, count)

    def write(self, address: int, values: list[int], now_s: float) -> bool:
        if address != WATCHDOG.register:
            self.calls.append("write")
            self.written.append(values)
        return super().write(address, values, now_s)

    def touched(self, now_s: float) -> None:
        self.asked += 1
        super().touched(now_s)


class Rig:
    """Control's end, the process (its steps called here) and the terminal behind it."""

    def __init__(self, served: ServedTerminal, terminal: Terminal, arm: EmulatedArm) -> None:
        self.served, self.terminal, self.arm = served, terminal, arm
        self.link = DeviceLink.create(multiprocessing.get_context("spawn"), 1)
        self.control = LinkedDevice(self.link)
        self.ends = multiprocessing.Pipe()
        self.process = DeviceProcess(configuration_for(served.port), self.link, self.ends[0])
        self.process._gap_max_s = GAP_MAX_S

    def write(self, pressures_pa: Array) -> None:
        now_s = time.monotonic()
        self.control.write(pressures_pa, now_s, now_s)

    def vent(self) -> None:
        self.control.vent(time.monotonic())

    @property
    def state(self) -> LinkState:
        standing = DeviceWatch(self.link).standing()
        assert standing is not None
        return standing.state

    def run(self, seconds: float, pressures_pa: Array | None) -> None:
        """Let control ask for the same again and again, None to vent, and the process step."""
        until_s = time.monotonic() + seconds
        while time.monotonic() < until_s:
            self.vent() if pressures_pa is None else self.write(pressures_pa)
            self.process.step()
            time.sleep(0.002)

    def active(self) -> "Rig":
        """Be connected, past the warm-up, and regulating."""
        for _ in range(WARM_UP_COMMANDS):
            self.vent()
        self.run(0.1, None)
        with suppress(HardwareError):  # that it was away
            self.control.read(time.monotonic())
        self.control.read(time.monotonic())
        self.run(0.2, SOME_PA)
        np.testing.assert_allclose(self.arm.setpoints_pa, SOME_PA)
        return self


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Iterator[Rig]:
    # Commands get old later than in a laboratory: this process has no priority over others.
    monkeypatch.setattr(Guard, "MAX_AGE_S", MAX_AGE_S)
    arm = EmulatedArm(load(None, "paper").build_arm(), 0)
    terminal = Terminal(arm)
    with ServedTerminal(terminal) as served:
        rig = Rig(served, terminal, arm)
        yield rig
        rig.process._let_go()


def test_nothing_but_zeros_before_control_is_warm_and_has_asked_to_vent(rig: Rig) -> None:
    for _ in range(WARM_UP_COMMANDS - 5):  # as the loop's warm-up writes
        rig.write(SOME_PA)
        rig.process.step()
        rig.process.step()
    assert rig.state == LinkState.CONNECTED
    time.sleep(MAX_AGE_S + 0.05)  # old by now, but the loop has not begun
    rig.process.step()
    assert rig.state == LinkState.CONNECTED
    rig.run(0.1, SOME_PA)  # warm, but never vented since it was connected
    assert np.array_equal(rig.arm.setpoints_pa, ZEROS)
    rig.run(0.05, None)
    rig.run(0.2, SOME_PA)
    np.testing.assert_allclose(rig.arm.setpoints_pa, SOME_PA)


def test_the_slew_holds_at_the_terminal_and_its_intervention_is_told(rig: Rig) -> None:
    rig.active()
    before_pa, before_s = rig.arm.setpoints_pa.copy(), time.monotonic()
    rig.run(0.02, np.full((1, 3), 9e4))
    slew = rig.process._device._guard._slew[0, 0]
    largest_pa = slew * (time.monotonic() - before_s + 0.05)
    assert (rig.arm.setpoints_pa - before_pa <= largest_pa).all()
    assert (rig.arm.setpoints_pa > before_pa).any()
    rig.control.read(time.monotonic())
    assert rig.control.write(SOME_PA, time.monotonic(), time.monotonic()).intervention


def test_a_loop_that_stands_still_gets_zeros_then_silence_and_is_not_covered(rig: Rig) -> None:
    rig.active()
    time.sleep(MAX_AGE_S + 0.05)
    rig.process.step()
    assert rig.state == LinkState.SILENT
    time.sleep(0.02)
    assert np.array_equal(rig.arm.setpoints_pa, ZEROS)
    asked = rig.terminal.asked
    for _ in range(20):
        rig.process.step()
        time.sleep(0.005)
    assert rig.terminal.asked == asked
    with pytest.raises(HardwareError, match=r"no command for 300 ms"):
        rig.control.read(time.monotonic())
    rig.run(0.2, SOME_PA)  # awake again, and as if nothing had been
    assert rig.state == LinkState.CONNECTED
    assert np.array_equal(rig.arm.setpoints_pa, ZEROS)
    with pytest.raises(HardwareError, match="connected again"):
        rig.control.read(time.monotonic())
    rig.active()


def test_half_of_the_watchdog_is_what_a_gap_may_be() -> None:
    for watchdog_ms, allowed_s in ((200, 0.1), (50, 0.025), (60000, 0.5 * SILENT_S)):
        tables = configuration_for(502).model_dump()
        tables["festo_cpx"] |= {"watchdog_ms": watchdog_ms}
        link = DeviceLink.create(multiprocessing.get_context("spawn"), 1)
        process = DeviceProcess(check(tables), link, multiprocessing.Pipe()[0])
        assert process._gap_max_s == pytest.approx(allowed_s)


@pytest.mark.parametrize("where", ["between", "in a read", "in a write"])
def test_a_process_that_stood_still_does_not_go_on(rig: Rig, where: str) -> None:
    """Control went on meanwhile, so that its commands are fresh; only the gap tells."""
    rig.active()
    writes = [setpoint.copy() for setpoint in rig.terminal.written]
    adapter, sleep = rig.process._device._hardware, lambda: time.sleep(GAP_MAX_S + 0.05)
    if where == "between":
        sleep()
    else:
        name = where.removeprefix("in a ")
        call = getattr(adapter, name)

        def stalled(*arguments: object) -> object:
            setattr(adapter, name, call)
            sleep()
            return call(*arguments)

        setattr(adapter, name, stalled)
    rig.write(SOME_PA)
    if where != "between":
        step = Thread(target=rig.process.step)
        step.start()
        while step.is_alive():  # control never falls silent
            rig.write(SOME_PA)
            time.sleep(0.002)
    else:
        rig.process.step()
    assert rig.state == LinkState.LOST
    rig.run(0.2, SOME_PA)
    assert rig.state == LinkState.CONNECTED
    assert np.array_equal(rig.arm.setpoints_pa, ZEROS)
    with pytest.raises(HardwareError, match=r"connected again|not talked to"):
        rig.control.read(time.monotonic())
    if where == "between":
        assert not any(np.any(counts) for counts in rig.terminal.written[len(writes) :])


def test_after_a_pause_the_terminal_is_read_before_it_is_written(rig: Rig) -> None:
    rig.active()
    pause_s = rig.process._look_first_s + 0.03
    assert pause_s < GAP_MAX_S
    time.sleep(pause_s)
    rig.terminal.calls.clear()
    rig.write(SOME_PA)
    rig.process.step()
    assert rig.state == LinkState.CONNECTED
    assert rig.terminal.calls[:3] == ["read", "write", "read"]


def first_error(rig: Rig) -> str:
    """Go on as control does, until it hears that something is wrong."""
    for _ in range(100):
        rig.run(0.01, SOME_PA)
        try:
            rig.control.read(time.monotonic())
        except HardwareError as error:
            return str(error)
    pytest.fail("control was told nothing")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("reset", "closed the connection|did not answer"),
        ("silence 0.2", "did not answer"),
        ("wrong", "did not answer"),
        ("garbage", "did not answer"),
        ("exception 1", "busy"),
        ("unplug 0.5", "closed the connection|cannot be reached|did not answer"),
    ],
)
def test_a_lost_device_is_told_and_found_again_vented(rig: Rig, words: str, told: str) -> None:
    rig.active()
    rig.served.inject(words)
    assert re.search(told, first_error(rig))
    for _ in range(40):
        rig.run(0.05, SOME_PA)
        if rig.state == LinkState.CONNECTED:
            break
    rig.run(0.1, SOME_PA)
    assert rig.state == LinkState.CONNECTED
    assert np.array_equal(rig.arm.setpoints_pa, ZEROS)  # it does not re-arm by itself
    rig.active()


def test_it_ends_vented_and_lets_the_terminal_go(rig: Rig) -> None:
    rig.active()
    rig.process._let_go()
    time.sleep(0.02)
    assert np.array_equal(rig.arm.setpoints_pa, ZEROS)

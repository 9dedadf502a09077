"""The device process on a clock of its own: what it does to the device, and when it ends."""

import multiprocessing
import time
from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.interface import Measurement
from pneuarm.service.configuration.configuration import load
from pneuarm.service.devices import process as module
from pneuarm.service.devices.keeper import DeviceKeeper
from pneuarm.service.devices.process import WARM_UP_COMMANDS, DeviceProcess
from pneuarm.service.processes.device_slots import DeviceLink, DeviceWatch, LinkedDevice, LinkState

SOME_PA = np.array([[2e4, -1e4, 1e4]])
ZEROS = np.zeros((1, 3))


class Clock:
    """Stands for the module ``time``: sleeping is what lets it go on."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.suspended_s = 0.0

    def clock_gettime(self, number: int) -> float:
        assert number == time.CLOCK_BOOTTIME
        return self.now_s + self.suspended_s

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        assert seconds >= 0.0
        self.now_s += seconds


class Device:
    """Writes down every call; an exchange takes as long as it is told, or fails."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.calls: list[str] = []
        self.asked: list[Array] = []
        self.set_pa = ZEROS
        self.write_takes_s = 0.0
        self.fails: set[str] = set()

    def _called(self, name: str) -> None:
        self.calls.append(name)
        if name in self.fails:
            raise HardwareError(f"{name} failed")

    def connect(self) -> None:
        self._called("connect")

    def read(self, time_s: float) -> Measurement:
        self._called("read")
        return Measurement(self.set_pa, ZEROS)

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        self._called("write")
        self.clock.sleep(self.write_takes_s)
        self.asked.append(pressures_pa.copy())
        self.set_pa = pressures_pa.copy()
        return pressures_pa

    def vent(self, time_s: float) -> None:
        self._called("vent")
        self.set_pa = ZEROS

    def close(self) -> None:
        self.calls.append("close")


class Rig:
    """Control's end, the process and the device, and whether the parent lives."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.clock = Clock()
        self.device = Device(self.clock)
        self.parent = True
        monkeypatch.setattr(module, "time", self.clock)
        monkeypatch.setattr(module.backends, "build", lambda *_: self.device)
        monkeypatch.setattr(module, "parent_is_alive", lambda: self.parent)
        self.link = DeviceLink.create(multiprocessing.get_context("spawn"), 1)
        self.control = LinkedDevice(self.link)
        self.end, theirs = multiprocessing.Pipe()
        self.configuration = load(None, "paper")
        self.process = DeviceProcess(self.configuration, self.link, theirs)

    @property
    def period_s(self) -> float:
        return self.process._period_s

    @property
    def state(self) -> LinkState:
        standing = DeviceWatch(self.link).standing()
        assert standing is not None
        return standing.state

    def tick(self, pressures_pa: Array | None, age_s: float = 0.0) -> None:
        """Control asks, None to vent; the process makes one exchange; a period goes by."""
        now_s = self.clock.now_s
        if pressures_pa is None:
            self.control.vent(now_s - age_s)
        else:
            self.control.write(pressures_pa, now_s - age_s, now_s)
        self.process.step()
        self.clock.sleep(self.period_s)

    def ticks(self, count: int, pressures_pa: Array | None) -> None:
        for _ in range(count):
            self.tick(pressures_pa)

    def active(self) -> "Rig":
        """Be warm, vented and regulating what is asked for."""
        self.ticks(WARM_UP_COMMANDS + 2, None)
        self.ticks(60, SOME_PA)
        np.testing.assert_allclose(self.device.set_pa, SOME_PA)
        return self


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Iterator[Rig]:
    rig = Rig(monkeypatch)
    yield rig
    rig.end.close()


def test_after_its_parent_is_gone_it_vents_however_fresh_the_commands_are(rig: Rig) -> None:
    rig.active()
    rig.parent = False
    assert not rig.process._is_over()  # control may still come to its own end
    rig.device.calls.clear()
    rig.ticks(20, SOME_PA)
    assert np.array_equal(rig.device.set_pa, ZEROS)
    assert "write" not in rig.device.calls


def test_an_orphan_ends_when_control_is_silent_or_at_last(rig: Rig) -> None:
    rig.active()
    rig.parent = False
    assert not rig.process._is_over()
    rig.clock.sleep(0.5 * module._VENT_BEFORE_END_S)
    assert not rig.process._is_over()
    rig.clock.sleep(0.6 * module._VENT_BEFORE_END_S)
    assert rig.process._is_over()


def test_an_orphan_without_commands_ends_at_once(rig: Rig) -> None:
    rig.active()
    rig.parent = False
    assert not rig.process._is_over()
    rig.clock.sleep(1.0)
    rig.process.step()
    assert rig.process._is_over()


def test_with_its_parent_it_ends_on_its_word_only(rig: Rig) -> None:
    rig.active()
    rig.clock.sleep(10.0 * module._VENT_BEFORE_END_S)
    rig.process.step()
    assert not rig.process._is_over()  # silent, and waiting for control
    rig.end.send(None)
    assert rig.process._is_over()


def test_the_slew_counts_from_the_answer_and_not_from_the_question(rig: Rig) -> None:
    rig.ticks(WARM_UP_COMMANDS + 2, None)
    rig.device.write_takes_s = 0.02
    rig.tick(np.full((1, 3), 8e4))
    before = rig.device.asked[-1]
    rig.tick(np.full((1, 3), 8e4))
    # Between the answer and the next question goes one period, and none of the 20 ms before.
    assert (rig.device.asked[-1] > before).all()
    slew = rig.configuration.build_arm().per_chamber("pressure_slew_max_pa_s")
    np.testing.assert_allclose(rig.device.asked[-1] - before, slew * rig.period_s)


def test_zeros_until_control_is_warm_and_has_asked_to_vent_since_the_connection(rig: Rig) -> None:
    rig.ticks(WARM_UP_COMMANDS, SOME_PA)
    rig.ticks(5, SOME_PA)
    assert "write" not in rig.device.calls
    rig.tick(None)
    rig.tick(SOME_PA)
    assert rig.device.calls[-2:] == ["write", "read"]


def test_an_order_to_vent_while_it_warms_up_is_none(rig: Rig) -> None:
    rig.ticks(WARM_UP_COMMANDS, None)
    rig.ticks(5, SOME_PA)
    assert "write" not in rig.device.calls


def test_commands_of_the_warm_up_may_be_of_any_age(rig: Rig) -> None:
    for _ in range(WARM_UP_COMMANDS):
        rig.tick(SOME_PA, age_s=10.0)
        assert rig.state == LinkState.CONNECTED or rig.device.calls.count("read") == 0
    rig.tick(SOME_PA, age_s=10.0)
    assert rig.state == LinkState.SILENT


@pytest.mark.parametrize("rate_hz", [200.0, 10.0])
def test_commands_get_old_after_three_periods_or_50_ms(
    monkeypatch: pytest.MonkeyPatch, rate_hz: float
) -> None:
    rig = Rig(monkeypatch)
    control = rig.configuration.control.model_copy(update={"rate_hz": rate_hz})
    configuration = rig.configuration.model_copy(update={"control": control})
    process = DeviceProcess(configuration, rig.link, multiprocessing.Pipe()[1])
    oldest_s = max(3.0 / rate_hz, 0.05)
    for _ in range(WARM_UP_COMMANDS + 1):
        rig.control.vent(rig.clock.now_s)
    process.step()
    rig.clock.sleep(0.99 * oldest_s)
    process.step()
    assert rig.state == LinkState.CONNECTED
    rig.clock.sleep(0.02 * oldest_s)
    process.step()
    assert rig.state == LinkState.SILENT


@pytest.mark.parametrize("asleep_s", [0.2, 3600.0])
def test_a_machine_that_was_suspended_comes_back_with_zeros(rig: Rig, asleep_s: float) -> None:
    """Nothing got old by the clock of the commands; the device's watchdog has run out."""
    rig.active()
    rig.device.asked.clear()
    rig.clock.suspended_s += asleep_s
    rig.tick(SOME_PA)
    assert rig.state == LinkState.LOST
    rig.ticks(20, SOME_PA)
    assert not rig.device.asked
    assert np.array_equal(rig.device.set_pa, ZEROS)


def test_a_gap_while_nothing_but_zeros_was_sent_is_no_loss(rig: Rig) -> None:
    rig.ticks(WARM_UP_COMMANDS + 2, None)
    rig.clock.suspended_s += 3600.0
    rig.tick(None)
    assert rig.state == LinkState.CONNECTED


def test_a_dead_process_is_zeroed_for_once_until_it_lives_again() -> None:
    """Each zeroing connects anew, for a second where the device is gone: the supervisor waits."""
    alive, zeroed = [False], []
    keeper = DeviceKeeper.__new__(DeviceKeeper)
    keeper._child = SimpleNamespace(is_alive=lambda: alive[0], kill=lambda: None)  # type: ignore[assignment]
    keeper._watch = SimpleNamespace(standing=lambda: None)  # type: ignore[assignment]
    keeper._spare = SimpleNamespace(  # type: ignore[assignment]
        connect=lambda: None, vent=zeroed.append, close=lambda: None
    )
    keeper._zeroed = False
    for _ in range(3):
        assert keeper.look_after() == ""
    assert len(zeroed) == 1
    alive[0] = True
    keeper.look_after()
    alive[0] = False
    keeper.look_after()
    assert len(zeroed) == 2


def test_silence_is_zeros_once_and_then_no_traffic_until_a_fresh_command(rig: Rig) -> None:
    rig.active()
    rig.device.calls.clear()
    rig.clock.sleep(1.0)
    rig.process.step()
    assert rig.device.calls == ["vent"]
    for _ in range(5):
        rig.process.step()
        rig.clock.sleep(rig.period_s)
    assert rig.device.calls == ["vent"]
    assert rig.state == LinkState.SILENT
    standing = DeviceWatch(rig.link).standing()
    assert standing is not None
    assert "50 ms" in standing.text
    assert "vent failed" not in standing.text
    rig.tick(SOME_PA)
    assert rig.device.calls == ["vent", "close", "connect", "vent", "read"]
    rig.ticks(5, SOME_PA)
    assert "write" not in rig.device.calls  # it does not re-arm itself
    rig.active()


def test_silence_over_a_device_that_does_not_answer_tells_so(rig: Rig) -> None:
    rig.active()
    rig.device.fails = {"vent"}
    rig.clock.sleep(1.0)
    rig.process.step()
    standing = DeviceWatch(rig.link).standing()
    assert standing is not None
    assert standing.state == LinkState.SILENT
    assert all(fact in standing.text for fact in ("50 ms", "vent failed"))


def test_a_device_that_was_not_there_gets_no_zeros_when_silence_falls(rig: Rig) -> None:
    rig.device.fails = {"connect"}
    rig.ticks(WARM_UP_COMMANDS + 1, None)
    rig.device.calls.clear()
    rig.clock.sleep(1.0)
    rig.process.step()
    assert rig.device.calls == []
    assert rig.state == LinkState.SILENT


@pytest.mark.parametrize("name", ["read", "write"])
def test_a_lost_device_is_connected_anew_at_once_then_now_and_then_and_stays_vented(
    rig: Rig, name: str
) -> None:
    rig.active()
    rig.device.fails = {name, "connect"}
    rig.device.calls.clear()
    rig.tick(SOME_PA)
    assert rig.device.calls[-1] == name
    assert rig.state == LinkState.LOST
    with pytest.raises(HardwareError, match=f"{name} failed"):
        rig.control.read(rig.clock.now_s)
    rig.tick(SOME_PA)
    assert rig.device.calls[-2:] == ["close", "connect"]
    tried_s = rig.clock.now_s
    while rig.device.calls.count("connect") < 2:
        rig.tick(SOME_PA)
    assert rig.clock.now_s - tried_s > 0.8 * module._RETRY_S
    rig.device.fails = set()
    while rig.state != LinkState.CONNECTED:
        rig.tick(SOME_PA)
    assert rig.device.calls[-4:] == ["close", "connect", "vent", "read"]
    rig.device.calls.clear()
    rig.ticks(5, SOME_PA)
    assert "write" not in rig.device.calls
    rig.active()


def test_what_the_device_took_and_what_the_guard_changed_are_told(rig: Rig) -> None:
    rig.active()
    rig.control.read(rig.clock.now_s)
    np.testing.assert_allclose(rig.control.sent_pa, SOME_PA)
    rig.tick(np.full((1, 3), 8e4))
    measurement = rig.control.read(rig.clock.now_s)
    np.testing.assert_allclose(measurement.pressures_pa, rig.device.set_pa)
    assert rig.control.write(SOME_PA, rig.clock.now_s, rig.clock.now_s).intervention
    rig.tick(None)
    rig.control.read(rig.clock.now_s)
    assert np.array_equal(rig.control.sent_pa, ZEROS)


def test_a_run_keeps_its_period_and_leaves_the_device_vented_and_closed(rig: Rig) -> None:
    rig.active()
    steps: list[float] = []
    step = rig.process.step

    def counted() -> None:
        steps.append(rig.clock.now_s)
        rig.control.write(SOME_PA, rig.clock.now_s, rig.clock.now_s)
        step()
        if len(steps) == 20:
            rig.end.send(None)

    rig.process.step = counted  # type: ignore[method-assign]
    rig.process.run()
    np.testing.assert_allclose(np.diff(steps), rig.period_s)
    assert rig.period_s == 1.0 / min(
        rig.configuration.hardware.exchange_rate_hz, rig.configuration.control.rate_hz
    )
    assert rig.device.calls[-2:] == ["vent", "close"]


def test_a_run_that_breaks_off_vents_and_closes_too(rig: Rig) -> None:
    rig.active()

    def broken() -> None:
        raise ZeroDivisionError

    rig.process.step = broken  # type: ignore[method-assign]
    rig.device.fails = {"vent"}
    with pytest.raises(ZeroDivisionError):
        rig.process.run()
    assert rig.device.calls[-2:] == ["vent", "close"]

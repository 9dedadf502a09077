"""The device process's times to the tick, what it does between two calls, and how it is begun."""

import multiprocessing
from types import SimpleNamespace

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.hardware.interface import Measurement
from pneuarm.service.devices import process as module
from pneuarm.service.devices.process import DeviceProcess
from pneuarm.service.processes.device_slots import LinkState
from tests.service.devices.test_process import SOME_PA, Clock, Rig


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Rig:
    return Rig(monkeypatch)


def another(rig: Rig, **control: float) -> DeviceProcess:
    """A process on the same link, with other rates: ``rate_hz`` and ``exchange_rate_hz``."""
    exchange_hz = control.pop("exchange_rate_hz", 1000.0)
    changed = {
        "control": rig.configuration.control.model_copy(update=control),
        "hardware": rig.configuration.hardware.model_copy(update={"exchange_rate_hz": exchange_hz}),
    }
    configuration = rig.configuration.model_copy(update=changed)
    return DeviceProcess(configuration, rig.link, multiprocessing.Pipe()[1])


# --- times --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("rate_hz", "exchange_hz"), [(100.0, 400.0), (400.0, 100.0)])
def test_it_exchanges_as_often_as_the_slower_of_loop_and_device(
    rig: Rig, rate_hz: float, exchange_hz: float
) -> None:
    process = another(rig, rate_hz=rate_hz, exchange_rate_hz=exchange_hz)
    assert process._period_s == 1.0 / 100.0


def test_the_eleventh_command_is_the_first_that_counts(rig: Rig) -> None:
    rig.ticks(11, None)
    rig.tick(SOME_PA)
    assert rig.device.calls[-2:] == ["write", "read"]


def test_a_command_of_just_its_age_is_fresh(rig: Rig) -> None:
    process = another(rig, rate_hz=48.0)  # three periods are a sixteenth of a second, to the bit
    rig.clock.now_s = 128.0
    for _ in range(11):
        rig.control.vent(128.0)
    process.step()
    rig.clock.now_s = 128.0625
    process.step()
    assert rig.state == LinkState.CONNECTED
    rig.clock.now_s = 128.0626
    process.step()
    assert rig.state == LinkState.SILENT


def test_a_lost_device_is_tried_again_after_three_tenths_of_a_second(rig: Rig) -> None:
    rig.device.fails = {"connect"}
    rig.clock.now_s = 128.0
    rig.process.step()
    rig.clock.now_s = 128.29
    before_s = rig.clock.now_s
    rig.process.step()
    assert rig.device.calls.count("connect") == 1
    assert rig.clock.now_s - before_s == pytest.approx(0.005)  # it neither spins nor sleeps long
    rig.clock.now_s = 128.0 + 0.3
    rig.process.step()
    assert rig.device.calls.count("connect") == 2


def test_soon_after_the_machine_has_started_it_connects_at_once_too(rig: Rig) -> None:
    rig.clock.now_s = 0.25
    rig.process.step()
    assert rig.state == LinkState.CONNECTED
    rig.device.fails = {"read"}
    rig.process.step()
    rig.device.fails = set()
    rig.process.step()
    assert rig.state == LinkState.CONNECTED


def test_an_orphan_vents_for_three_seconds_and_no_longer(rig: Rig) -> None:
    rig.active()
    rig.parent = False
    rig.clock.now_s = 128.0
    assert not rig.process._is_over()
    rig.clock.now_s = 131.0
    assert not rig.process._is_over()
    rig.clock.now_s = 131.01
    assert rig.process._is_over()


def test_a_step_that_takes_long_is_not_made_up_for_in_a_burst(rig: Rig) -> None:
    begun_s: list[float] = []

    def slow_once() -> None:
        begun_s.append(rig.clock.now_s)
        rig.clock.sleep(10.0 * rig.period_s if len(begun_s) == 3 else 0.0)
        if len(begun_s) == 8:
            rig.end.send(None)

    rig.process.step = slow_once  # type: ignore[method-assign]
    rig.process.run()
    periods = np.diff(begun_s) / rig.period_s
    np.testing.assert_allclose(periods, [1.0, 1.0, 10.0, 1.0, 1.0, 1.0, 1.0], rtol=1e-6)


def test_a_clock_that_goes_on_between_two_looks_is_not_slept_backwards(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Running(Clock):
        def monotonic(self) -> float:
            self.now_s += 1e-6
            return self.now_s

    monkeypatch.setattr(module, "time", Running())
    steps = []

    def slow() -> None:
        steps.append(1)
        module.time.sleep(1.0)
        if len(steps) == 3:
            rig.end.send(None)

    rig.process.step = slow  # type: ignore[method-assign]
    rig.process.run()
    assert len(steps) == 3


# --- gaps ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("watchdog_s", "largest_s"), [(0.1, 0.05), (10.0, 0.15)])
@pytest.mark.parametrize("share", [0.98, 1.02])
def test_a_gap_of_half_the_watchdog_or_of_half_of_what_is_silence_is_a_loss(
    monkeypatch: pytest.MonkeyPatch, watchdog_s: float, largest_s: float, share: float
) -> None:
    rig = Rig(monkeypatch)
    device = type(rig.configuration.device)
    monkeypatch.setattr(device, "watchdog_s", lambda self, config: watchdog_s)
    rig.process = another(rig)
    rig.active()
    rig.clock.suspended_s += share * largest_s - rig.period_s
    rig.tick(SOME_PA)
    assert rig.state == (LinkState.CONNECTED if share < 1.0 else LinkState.LOST)


def test_a_gap_counts_where_one_chamber_alone_has_pressure(rig: Rig) -> None:
    rig.active()
    rig.ticks(60, np.array([[2e4, 0.0, 0.0]]))
    rig.clock.suspended_s += 1.0
    rig.tick(SOME_PA)
    assert rig.state == LinkState.LOST


def test_the_bounds_of_a_gap_and_of_a_pause_are_to_the_bit(rig: Rig) -> None:
    rig.active()
    rig.process._look_first_s, rig.process._gap_max_s = 0.125, 0.25
    for gap_s, calls in (
        (0.125, ["write", "read"]),
        (0.1875, ["read", "write", "read"]),
        (0.25, ["read", "write", "read"]),
    ):
        rig.process._exchanged_s = 128.0
        rig.clock.now_s, rig.clock.suspended_s = 128.0 + gap_s, 0.0
        rig.control.write(SOME_PA, rig.clock.now_s, rig.clock.now_s)
        rig.device.calls.clear()
        rig.process.step()
        assert rig.device.calls == calls


def gap(rig: Rig) -> None:
    rig.clock.suspended_s += 1.0


def test_a_gap_right_before_a_write_is_seen_before_it(rig: Rig) -> None:
    rig.active()
    rig.process._look_first_s = 10.0
    rig.device.calls.clear()
    gap(rig)
    rig.tick(SOME_PA)
    assert rig.device.calls == []
    assert rig.state == LinkState.LOST


def test_a_gap_in_a_write_is_seen_before_it_is_acknowledged(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig.active()
    acknowledged: list[float] = []
    monkeypatch.setattr(rig.process._device, "acknowledged", acknowledged.append)
    rig.device.write_takes_s = 1.0
    rig.device.calls.clear()
    rig.tick(SOME_PA)
    assert (rig.device.calls, acknowledged) == (["write"], [])
    assert rig.state == LinkState.LOST


def test_a_gap_between_write_and_read_is_seen_before_the_read(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig.active()
    monkeypatch.setattr(rig.process._link, "sent", lambda sent_pa: gap(rig))
    rig.device.calls.clear()
    rig.tick(SOME_PA)
    assert rig.device.calls == ["write"]
    assert rig.state == LinkState.LOST


def test_what_was_read_after_a_gap_is_not_passed_on(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig.active()
    read, measured = rig.device.read, []

    def late(time_s: float) -> Measurement:
        gap(rig)
        return read(time_s)

    monkeypatch.setattr(rig.device, "read", late)
    monkeypatch.setattr(rig.process._link, "measured", lambda *all: measured.append(all))
    rig.tick(SOME_PA)
    assert measured == []
    assert rig.state == LinkState.LOST


# --- commands -----------------------------------------------------------------------------------


def test_without_control_it_keeps_the_device_content_with_zeros(rig: Rig) -> None:
    for _ in range(3):
        rig.process.step()
    assert rig.device.calls == ["close", "connect", "vent", "read", *["vent", "read"] * 2]
    assert rig.state == LinkState.CONNECTED


def test_an_order_to_vent_is_a_vent_and_no_write(rig: Rig) -> None:
    rig.active()
    rig.device.calls.clear()
    rig.tick(None)
    assert rig.device.calls == ["vent", "read"]
    rig.tick(SOME_PA)
    assert rig.device.calls[-2:] == ["write", "read"]


def test_it_tells_that_it_connects_while_it_does(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    states = []
    monkeypatch.setattr(rig.device, "connect", lambda: states.append(rig.state))
    rig.device.fails = {"read"}
    rig.process.step()
    rig.device.fails = set()
    rig.clock.sleep(1.0)
    rig.process.step()
    assert states == [LinkState.STARTING] * 2


def test_a_device_that_was_lost_gets_no_zeros_at_the_end(rig: Rig) -> None:
    rig.device.fails = {"connect"}
    rig.process.step()
    rig.end.send(None)
    rig.device.calls.clear()
    rig.process.run()
    assert rig.device.calls == ["close"]


# --- the entry point ----------------------------------------------------------------------------


@pytest.mark.parametrize(("priority", "taken"), [(50, 49), (2, 1), (1, 1)])
@pytest.mark.parametrize("has_device", [True, False])
def test_it_is_begun_right_below_the_loop_where_there_is_a_device(
    monkeypatch: pytest.MonkeyPatch, priority: int, taken: int, has_device: bool
) -> None:
    told: list[object] = []

    class Begun:
        def __init__(self, *arguments: object) -> None:
            told.append(arguments)

        def run(self) -> None:
            told.append("run")

    monkeypatch.setattr(module, "DeviceProcess", Begun)
    monkeypatch.setattr(module, "ignore_terminal_signals", lambda: told.append("ignored"))
    monkeypatch.setattr(module.realtime, "take_priority", told.append)
    configuration = SimpleNamespace(control=SimpleNamespace(priority=priority))
    shared = SimpleNamespace(configuration=configuration, device="link" if has_device else None)
    module.main(shared, None, None, "end")  # type: ignore[arg-type]
    begun = [(configuration, "link", "end"), "run"] if has_device else []
    assert told == ["ignored", taken, *begun]


def test_the_pressures_of_a_command_reach_the_device(rig: Rig) -> None:
    rig.active()
    asked: Array = np.array([[2e4, -1e4, 1.05e4]])
    rig.tick(asked)
    np.testing.assert_allclose(rig.device.asked[-1], asked)

"""The contract of a device, as tests: every adapter keeps it, and so does one of your own.

    from pneuarm.service.devices.contract import DeviceContract

    class TestValveBox(DeviceContract):
        device = DEVICE
        resolution_pa = 100.0

is a whole test file, and pytest runs it against the emulator of the device. This module needs
pytest; nothing else here loads it.
"""

import math
import time
from argparse import ArgumentParser
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.device import EmulatedDevice
from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.interface import Hardware, Measurement
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.configuration.configuration import check as check_tables
from pneuarm.service.configuration.devices import AnyDevice
from pneuarm.service.devices import registry

#: How long a word or a command takes to arrive at an emulator (s).
_SETTLE_S = 0.05

#: With vacuum, and without.
ARMS = ("paper", "table1")


def _fall_silent() -> None:
    """Say nothing more, as a host that hangs or has died."""


class SimulatedClock:
    """Time that passes only when it is told to, for devices that live in simulated time."""

    def __init__(self) -> None:
        self.now_s = 10.0

    def pass_s(self, seconds: float) -> None:
        self.now_s += seconds


class RealClock:
    """Time as it is, for devices behind a real transport."""

    @property
    def now_s(self) -> float:
        return time.monotonic()

    @staticmethod
    def pass_s(seconds: float) -> None:
        time.sleep(seconds)


@dataclass
class Bench:
    """One device on the bench: its adapter, not yet connected, and hands on the device itself.

    ``has_watchdog`` is what the device's ``left_behind`` says: nothing stays in the arm.
    ``told_pa`` returns the pressures (n_sections, 3) that the device regulates to now, seen from
    the device's side; it is None where there is no such side. ``resolution_pa`` is the smallest
    step of a command on the transport, 0 where it takes any number; ``told_tolerance_pa`` is how
    far ``told_pa`` may be from what was sent. ``period_s`` is how long the
    device needs between two calls. ``unplug`` takes the device away so that it falls silent or
    its transport breaks, ``plug`` brings it back, at rest; both None where it cannot go.
    ``timeout_s`` is the time within which the adapter must say that it is gone. ``abandon`` does
    what a dying host does, as a rule nothing at all; ``watchdog_s`` is when the
    device's own watchdog has then run out.
    """

    arm: Arm
    hardware: Hardware
    has_watchdog: bool = True
    told_pa: Callable[[], Array] | None = None
    told_tolerance_pa: float = 1e-3
    resolution_pa: float = 0.0
    period_s: float = 0.01
    unplug: Callable[[], None] | None = None
    plug: Callable[[], None] | None = None
    timeout_s: float = 1.0
    abandon: Callable[[], None] = _fall_silent
    watchdog_s: float = 0.5
    clock: SimulatedClock | RealClock = field(default_factory=SimulatedClock)

    @property
    def low_pa(self) -> Array:
        return self.arm.per_chamber("pressure_min_pa")

    @property
    def high_pa(self) -> Array:
        return self.arm.per_chamber("pressure_max_pa")

    def some_pa(self) -> Array:
        """A command well inside the arm's limits, no two chambers alike, on no round number."""
        shares = np.linspace(0.21, 0.67, self.arm.n_chambers).reshape(-1, 3)
        return self.low_pa + shares * (self.high_pa - self.low_pa) + 3.7

    def assert_told(self, expected_pa: Array) -> None:
        """Check what the device itself was told, where it has such a side."""
        if self.told_pa is not None:
            np.testing.assert_allclose(
                self.told_pa(), expected_pa, rtol=0.0, atol=self.told_tolerance_pa
            )

    def connect(self) -> Hardware:
        """Connect, and read once: the first reading sets the clock of a simulated device."""
        self.hardware.connect()
        self.hardware.read(self.now_s())
        return self.hardware

    def now_s(self) -> float:
        """Let the device's period pass, and say what time it is."""
        self.clock.pass_s(self.period_s)
        return self.clock.now_s


def _outside(bench: Bench) -> tuple[Callable[[], None], Callable[[], None]]:
    """Return how to unplug the device and to plug it in; skip what only one outside of here can."""
    if bench.unplug is None or bench.plug is None:
        pytest.skip("it lives and dies with its host")
    return bench.unplug, bench.plug


def _assert_one_sentence(error: HardwareError) -> None:
    """Check an error for the person in the laboratory: one line, not a repr, not a novel."""
    text = str(error)
    assert "\n" not in text, text
    assert 30 < len(text) < 400, text
    assert "Traceback" not in text
    assert "object at 0x" not in text


def _assert_measured(bench: Bench, measurement: Measurement) -> None:
    """Check the shapes and the NaN rules of one reading."""
    shape = (bench.arm.n_sections, 3)
    assert measurement.pressures_pa.shape == shape
    assert measurement.pressures_pa.dtype == np.float64
    assert np.isfinite(measurement.pressures_pa).all()
    assert measurement.lengths_m.shape == shape
    known = measurement.lengths_m[~np.isnan(measurement.lengths_m)]
    assert ((known > 0.01) & (known < 3.0 * bench.arm.max_length_m)).all(), "lengths in m?"
    assert measurement.taken_s is None or measurement.taken_s <= bench.clock.now_s
    if measurement.setpoints_pa is not None:
        assert measurement.setpoints_pa.shape == shape
    assert math.isnan(measurement.supply_pa) or math.isfinite(measurement.supply_pa)
    assert all(isinstance(complaint, str) and complaint for complaint in measurement.complaints)


def _bad_commands(n_sections: int) -> list[Array]:
    """Return commands of a wrong shape, and with an element that is no number."""
    good = np.zeros((n_sections, 3))
    bad = [np.zeros(3 * n_sections), np.zeros((n_sections + 1, 3)), np.zeros((3, n_sections + 1))]
    for value in (np.nan, np.inf, -np.inf):
        bad.append(good.copy())
        bad[-1][-1, -1] = value
    return bad


def _calls(hardware: Hardware, n_sections: int) -> list[Callable[[float], object]]:
    """Every call that takes a time."""
    return [
        hardware.read,
        hardware.vent,
        lambda time_s: hardware.write(np.zeros((n_sections, 3)), time_s),
    ]


def _first_error(bench: Bench) -> HardwareError:
    """Read and write until the adapter says that the device is gone; fail when it never does."""
    give_up_s = bench.clock.now_s + 3.0 * bench.timeout_s
    while bench.clock.now_s < give_up_s:
        try:
            bench.hardware.read(bench.now_s())
            bench.hardware.write(bench.some_pa(), bench.now_s())
        except HardwareError as error:
            return error
    pytest.fail(f"no error {3.0 * bench.timeout_s:g} s after the device went")


class DeviceContract:
    """Subclass it, name the ``device``, and pytest finds the tests.

    ``resolution_pa`` is the smallest step of a command on its transport (Pa), ``period_s`` how long
    it needs between two calls, ``timeout_s`` within which its adapter must say that it is gone, and
    ``watchdog_s`` when its own watchdog has run out. ``keys`` are keys of its table, beside those
    that its emulator gives. A device without an emulator overrides :meth:`open`.
    """

    device: ClassVar[AnyDevice]
    resolution_pa: ClassVar[float]
    period_s: ClassVar[float] = 0.01
    timeout_s: ClassVar[float] = 1.0
    watchdog_s: ClassVar[float] = 0.5
    keys: ClassVar[Mapping[str, object]] = {}

    @contextmanager
    def open(self, preset: str) -> Iterator[Bench]:
        """Put the device on the bench, emulated, with a built-in arm that it can move."""
        device = self.device
        if not isinstance(device, EmulatedDevice):
            raise TypeError(f"device {device.name!r} has no emulator: override open()")
        own = self.configured(preset, self.keys)
        arm, emulated = own.build_arm(), EmulatedArm(own.build_simulated_arm(), 0)
        parser = ArgumentParser()
        device.add_arguments(parser)
        options = parser.parse_args([])
        with device.emulate(own.of_device(device), arm, emulated, options) as emulation:
            whole = self.configured(preset, {**self.keys, **emulation.table})

            def told_pa() -> Array:
                time.sleep(_SETTLE_S)
                return emulated.setpoints_pa.copy()

            def say(words: str) -> None:
                emulation.inject(words)
                time.sleep(_SETTLE_S)

            yield Bench(
                arm,
                registry.build(whole, arm),
                has_watchdog=not device.left_behind(whole.of_device(device)),
                told_pa=told_pa,
                resolution_pa=self.resolution_pa,
                period_s=self.period_s,
                unplug=lambda: say("unplug 1000"),
                plug=lambda: say("clear"),
                timeout_s=self.timeout_s,
                watchdog_s=self.watchdog_s,
                clock=RealClock(),
            )

    def configured(
        self, preset: str, keys: Mapping[str, object], name: str = "contract"
    ) -> Configuration:
        """Return a configuration with this device, for an arm called ``name``."""
        tables = registry.fitting(self.device, preset).model_dump(exclude_none=True)
        tables["arm"]["name"] = name
        tables["hardware"] |= {"adapter": self.device.name, "device": "contract"}
        tables[self.device.table] |= keys
        return check_tables(tables)

    @pytest.fixture(params=ARMS)
    def bench(self, request: pytest.FixtureRequest) -> Iterator[Bench]:
        """The device with an arm on it; whatever a test leaves behind is closed."""
        with self.open(request.param) as opened:
            yield opened
            opened.hardware.close()

    def test_the_lock_is_on_the_device_whatever_the_arm_is_called(self) -> None:
        one, other = (self.configured(ARMS[1], self.keys, name) for name in ("one", "other"))
        assert registry.address(one) == registry.address(other)

    def test_connecting_sets_every_output_to_zero(self, bench: Bench) -> None:
        """Also on a device that a dead host left under pressure."""
        bench.connect()
        bench.assert_told(np.zeros((bench.arm.n_sections, 3)))

    def test_a_reading_has_the_arms_shape_and_is_not_changed_by_the_next(
        self, bench: Bench
    ) -> None:
        hardware = bench.connect()
        first = hardware.read(bench.now_s())
        _assert_measured(bench, first)
        kept = first.pressures_pa.copy()
        hardware.write(bench.some_pa(), bench.now_s())
        for _ in range(5):
            _assert_measured(bench, hardware.read(bench.now_s()))
        assert np.array_equal(first.pressures_pa, kept)

    def test_write_returns_what_was_really_sent(self, bench: Bench) -> None:
        """The nearest that the transport can say; the caller's array is not kept, nor changed."""
        hardware = bench.connect()
        asked = bench.some_pa()
        given = asked.copy()
        sent = hardware.write(given, bench.now_s())
        assert np.array_equal(given, asked)
        given[:] = 0.0
        assert sent.shape == asked.shape
        np.testing.assert_allclose(sent, asked, rtol=0.0, atol=bench.resolution_pa + 1e-9)
        bench.assert_told(sent)

    def test_nothing_outside_the_limits_is_sent(self, bench: Bench) -> None:
        """Beyond a limit it is the limit, or the last step before it."""
        hardware = bench.connect()
        for asked in (bench.high_pa + 5e4, bench.low_pa - 5e4):
            sent = hardware.write(asked, bench.now_s())
            assert (sent >= bench.low_pa).all()
            assert (sent <= bench.high_pa).all()
            limit = np.clip(asked, bench.low_pa, bench.high_pa)
            np.testing.assert_allclose(sent, limit, rtol=0.0, atol=bench.resolution_pa + 1e-9)
            bench.assert_told(sent)

    def test_a_command_that_is_none_is_refused_before_anything_is_sent(self, bench: Bench) -> None:
        """And the command before it still stands."""
        hardware = bench.connect()
        sent = hardware.write(bench.some_pa(), bench.now_s())
        for command in _bad_commands(bench.arm.n_sections):
            with pytest.raises(HardwareError) as raised:
                hardware.write(command, bench.now_s())
            _assert_one_sentence(raised.value)
        bench.assert_told(sent)

    def test_venting_zeroes_whatever_was_written(self, bench: Bench) -> None:
        """Also twice, and right after a write; and a write afterwards acts again."""
        hardware = bench.connect()
        hardware.write(bench.some_pa(), bench.now_s())
        time_s = bench.now_s()
        hardware.vent(time_s)
        hardware.vent(bench.now_s())
        bench.assert_told(np.zeros((bench.arm.n_sections, 3)))
        sent = hardware.write(bench.some_pa(), bench.now_s())
        bench.assert_told(sent)
        np.testing.assert_allclose(sent, bench.some_pa(), rtol=0.0, atol=bench.resolution_pa + 1e-9)

    def test_it_answers_only_while_connected(self, bench: Bench) -> None:
        """Neither before connect nor after close; closing what is not open is nothing."""
        bench.hardware.close()
        for _ in range(2):
            for call in _calls(bench.hardware, bench.arm.n_sections):
                with pytest.raises(HardwareError) as raised:
                    call(bench.now_s())
                _assert_one_sentence(raised.value)
            bench.connect()
            bench.hardware.close()
            bench.hardware.close()

    def test_a_time_that_runs_backwards_does_no_harm(self, bench: Bench) -> None:
        """It is refused, or it changes nothing; the next good call goes on."""
        hardware = bench.connect()
        hardware.write(bench.some_pa(), bench.now_s())
        for bad_s in (bench.clock.now_s - 1.0, 0.0, math.nan):
            for call in _calls(hardware, bench.arm.n_sections):
                try:
                    call(bad_s)
                except HardwareError as error:
                    _assert_one_sentence(error)
        _assert_measured(bench, hardware.read(bench.now_s()))
        sent = hardware.write(bench.some_pa(), bench.now_s())
        np.testing.assert_allclose(sent, bench.some_pa(), rtol=0.0, atol=bench.resolution_pa + 1e-9)

    def test_it_starts_at_zeros_again_after_being_closed(self, bench: Bench) -> None:
        for _ in range(2):
            bench.connect()
            bench.assert_told(np.zeros((bench.arm.n_sections, 3)))
            bench.hardware.write(bench.some_pa(), bench.now_s())
            bench.hardware.close()

    def test_closing_leaves_no_pressure_behind(self, bench: Bench) -> None:
        """Also without a vent before it: on every way out."""
        _outside(bench)
        bench.connect().write(bench.some_pa(), bench.now_s())
        bench.hardware.close()
        bench.clock.pass_s(0.1)
        bench.assert_told(np.zeros((bench.arm.n_sections, 3)))

    def test_a_device_that_is_gone_is_told_in_one_sentence_and_found_again(
        self, bench: Bench
    ) -> None:
        """Within the timeout, as a HardwareError alone; afterwards it starts at zeros."""
        unplug, plug = _outside(bench)
        bench.connect().write(bench.some_pa(), bench.now_s())
        unplug()
        gone_s = bench.clock.now_s
        _assert_one_sentence(_first_error(bench))
        assert bench.clock.now_s - gone_s < bench.timeout_s + 1.0
        for call in (
            bench.hardware.vent,
            bench.hardware.read,
        ):  # a supervisor tries these all the same
            try:
                call(bench.now_s())
            except HardwareError as error:
                _assert_one_sentence(error)
        bench.hardware.close()
        plug()
        bench.connect()
        bench.assert_told(np.zeros((bench.arm.n_sections, 3)))
        bench.assert_told(bench.hardware.write(bench.some_pa(), bench.now_s()))

    def test_connecting_to_a_device_that_is_not_there_is_refused(self, bench: Bench) -> None:
        unplug, plug = _outside(bench)
        unplug()
        with pytest.raises(HardwareError) as raised:
            bench.hardware.connect()
        _assert_one_sentence(raised.value)
        bench.hardware.close()
        plug()
        _assert_measured(bench, bench.connect().read(bench.now_s()))

    def test_what_it_leaves_behind_is_true_to_the_device(self, bench: Bench) -> None:
        """A host that falls silent: the device vents by itself, or it does not and says so."""
        _outside(bench)
        sent = bench.connect().write(bench.some_pa(), bench.now_s())
        bench.assert_told(sent)
        bench.abandon()
        bench.clock.pass_s(bench.watchdog_s)
        bench.assert_told(np.zeros_like(sent) if bench.has_watchdog else sent)

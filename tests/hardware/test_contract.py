"""The contract of a :class:`pneuarm.hardware.interface.Hardware`, kept by every adapter."""

import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.interface import Hardware, Measurement
from tests.hardware.contract import ARMS, DEVICES, TOLD_TOLERANCE_PA, Bench
from tests.hardware.festo_bench import FESTO

ALL = DEVICES | FESTO


@pytest.fixture(params=ALL)
def device(request: pytest.FixtureRequest) -> str:
    """Name of the adapter."""
    name: str = request.param
    return name


@pytest.fixture(params=ARMS)
def bench(request: pytest.FixtureRequest, device: str) -> Iterator[Bench]:
    """The device with an arm on it; whatever a test leaves behind is closed."""
    with ALL[device](ARMS[request.param]) as opened:
        yield opened
        opened.hardware.close()


@pytest.fixture
def assert_told(bench: Bench, device: str) -> Callable[[Array], None]:
    """Return a check of what the device itself was told; nothing to check for a device of ours."""

    def check(expected_pa: Array) -> None:
        if bench.told_pa is not None:
            allowed_pa = TOLD_TOLERANCE_PA.get(device, 1e-6 + 1e-3 * bench.resolution_pa)
            np.testing.assert_allclose(bench.told_pa(), expected_pa, rtol=0.0, atol=allowed_pa)

    return check


def outside(bench: Bench) -> None:
    """Skip what only a device outside of this process can do."""
    if bench.unplug is None or bench.plug is None or bench.abandon is None:
        pytest.skip("it lives and dies with its host")


def assert_one_sentence(error: HardwareError) -> None:
    """Check an error for the person in the laboratory: one line, not a repr, not a novel."""
    text = str(error)
    assert "\n" not in text, text
    assert 30 < len(text) < 400, text
    assert "Traceback" not in text
    assert "object at 0x" not in text


def assert_measured(bench: Bench, measurement: Measurement) -> None:
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


def test_connecting_sets_every_output_to_zero(
    bench: Bench, assert_told: Callable[[Array], None]
) -> None:
    """Also on a device that a dead host left under pressure."""
    bench.connect()
    assert_told(np.zeros((bench.arm.n_sections, 3)))


def test_a_reading_has_the_arms_shape_and_is_not_changed_by_the_next(bench: Bench) -> None:
    hardware = bench.connect()
    first = hardware.read(bench.now_s())
    assert_measured(bench, first)
    kept = first.pressures_pa.copy()
    hardware.write(bench.some_pa(), bench.now_s())
    for _ in range(5):
        assert_measured(bench, hardware.read(bench.now_s()))
    assert np.array_equal(first.pressures_pa, kept)


def test_write_returns_what_was_really_sent(
    bench: Bench, assert_told: Callable[[Array], None]
) -> None:
    """The nearest that the transport can say; the caller's array is neither kept nor changed."""
    hardware = bench.connect()
    asked = bench.some_pa()
    given = asked.copy()
    sent = hardware.write(given, bench.now_s())
    assert np.array_equal(given, asked)
    given[:] = 0.0
    assert sent.shape == asked.shape
    np.testing.assert_allclose(sent, asked, rtol=0.0, atol=bench.resolution_pa + 1e-9)
    assert_told(sent)


def test_nothing_outside_the_limits_is_sent(
    bench: Bench, assert_told: Callable[[Array], None]
) -> None:
    """Beyond a limit it is the limit, or the last step before it."""
    hardware = bench.connect()
    for asked in (bench.high_pa + 5e4, bench.low_pa - 5e4):
        sent = hardware.write(asked, bench.now_s())
        assert (sent >= bench.low_pa).all()
        assert (sent <= bench.high_pa).all()
        limit = np.clip(asked, bench.low_pa, bench.high_pa)
        np.testing.assert_allclose(sent, limit, rtol=0.0, atol=bench.resolution_pa + 1e-9)
        assert_told(sent)


def bad_commands(n_sections: int) -> list[Array]:
    """Return commands of a wrong shape, and with an element that is no number."""
    good = np.zeros((n_sections, 3))
    bad = [np.zeros(3 * n_sections), np.zeros((n_sections + 1, 3)), np.zeros((3, n_sections + 1))]
    for value in (np.nan, np.inf, -np.inf):
        bad.append(good.copy())
        bad[-1][-1, -1] = value
    return bad


def test_a_command_that_is_none_is_refused_before_anything_is_sent(
    bench: Bench, assert_told: Callable[[Array], None]
) -> None:
    """And the command before it still stands."""
    hardware = bench.connect()
    sent = hardware.write(bench.some_pa(), bench.now_s())
    for command in bad_commands(bench.arm.n_sections):
        with pytest.raises(HardwareError) as raised:
            hardware.write(command, bench.now_s())
        assert_one_sentence(raised.value)
    assert_told(sent)


def test_venting_zeroes_whatever_was_written(
    bench: Bench, assert_told: Callable[[Array], None]
) -> None:
    """Also twice, and right after a write; and a write afterwards acts again."""
    hardware = bench.connect()
    hardware.write(bench.some_pa(), bench.now_s())
    time_s = bench.now_s()
    hardware.vent(time_s)
    hardware.vent(bench.now_s())
    assert_told(np.zeros((bench.arm.n_sections, 3)))
    sent = hardware.write(bench.some_pa(), bench.now_s())
    assert_told(sent)
    np.testing.assert_allclose(sent, bench.some_pa(), rtol=0.0, atol=bench.resolution_pa + 1e-9)


def calls(hardware: Hardware, n_sections: int) -> list[Callable[[float], object]]:
    """Every call that takes a time."""
    return [
        hardware.read,
        hardware.vent,
        lambda time_s: hardware.write(np.zeros((n_sections, 3)), time_s),
    ]


def test_it_answers_only_while_connected(bench: Bench) -> None:
    """Neither before connect nor after close; closing what is not open is nothing."""
    bench.hardware.close()
    for _ in range(2):
        for call in calls(bench.hardware, bench.arm.n_sections):
            with pytest.raises(HardwareError) as raised:
                call(bench.now_s())
            assert_one_sentence(raised.value)
        bench.connect()
        bench.hardware.close()
        bench.hardware.close()


def test_a_time_that_runs_backwards_does_no_harm(bench: Bench) -> None:
    """It is refused, or it changes nothing; the next good call goes on."""
    hardware = bench.connect()
    hardware.write(bench.some_pa(), bench.now_s())
    for bad_s in (bench.clock.now_s - 1.0, 0.0, math.nan):
        for call in calls(hardware, bench.arm.n_sections):
            try:
                call(bad_s)
            except HardwareError as error:
                assert_one_sentence(error)
    assert_measured(bench, hardware.read(bench.now_s()))
    sent = hardware.write(bench.some_pa(), bench.now_s())
    np.testing.assert_allclose(sent, bench.some_pa(), rtol=0.0, atol=bench.resolution_pa + 1e-9)


def test_it_starts_at_zeros_again_after_being_closed(
    bench: Bench, assert_told: Callable[[Array], None]
) -> None:
    for _ in range(2):
        bench.connect()
        assert_told(np.zeros((bench.arm.n_sections, 3)))
        bench.hardware.write(bench.some_pa(), bench.now_s())
        bench.hardware.close()


def test_closing_leaves_no_pressure_behind(
    bench: Bench, assert_told: Callable[[Array], None]
) -> None:
    """Also without a vent before it: on every way out."""
    outside(bench)
    bench.connect().write(bench.some_pa(), bench.now_s())
    bench.hardware.close()
    bench.clock.pass_s(0.1)
    assert_told(np.zeros((bench.arm.n_sections, 3)))


def first_error(bench: Bench) -> HardwareError:
    """Read and write until the adapter says that the device is gone; fail when it never does."""
    give_up_s = bench.clock.now_s + 3.0 * bench.timeout_s
    while bench.clock.now_s < give_up_s:
        try:
            bench.hardware.read(bench.now_s())
            bench.hardware.write(bench.some_pa(), bench.now_s())
        except HardwareError as error:
            return error
    pytest.fail(f"no error {3.0 * bench.timeout_s:g} s after the device went")


def test_a_device_that_is_gone_is_told_in_one_sentence_and_found_again(
    bench: Bench, assert_told: Callable[[Array], None]
) -> None:
    """Within the timeout, as a HardwareError and nothing else; afterwards it starts at zeros."""
    outside(bench)
    bench.connect().write(bench.some_pa(), bench.now_s())
    bench.unplug()
    gone_s = bench.clock.now_s
    assert_one_sentence(first_error(bench))
    assert bench.clock.now_s - gone_s < bench.timeout_s + 1.0
    for call in (bench.hardware.vent, bench.hardware.read):  # a supervisor tries these all the same
        try:
            call(bench.now_s())
        except HardwareError as error:
            assert_one_sentence(error)
    bench.hardware.close()
    bench.plug()
    bench.connect()
    assert_told(np.zeros((bench.arm.n_sections, 3)))
    assert_told(bench.hardware.write(bench.some_pa(), bench.now_s()))


def test_connecting_to_a_device_that_is_not_there_is_refused(bench: Bench) -> None:
    outside(bench)
    bench.unplug()
    with pytest.raises(HardwareError) as raised:
        bench.hardware.connect()
    assert_one_sentence(raised.value)
    bench.hardware.close()
    bench.plug()
    assert_measured(bench, bench.connect().read(bench.now_s()))


def test_has_watchdog_is_true_to_the_device(
    bench: Bench, assert_told: Callable[[Array], None]
) -> None:
    """A host that falls silent: the device vents by itself, or it does not and says so."""
    outside(bench)
    sent = bench.connect().write(bench.some_pa(), bench.now_s())
    assert_told(sent)
    bench.abandon()
    bench.clock.pass_s(bench.watchdog_s)
    assert_told(np.zeros_like(sent) if bench.hardware.has_watchdog else sent)

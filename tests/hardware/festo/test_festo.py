"""Registers of CPX and VTEM, and what their adapters refuse; on emulated terminals."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.festo.counts import counts_of, pressures_of
from pneuarm.hardware.festo.terminal_watchdog import TerminalWatchdog
from pneuarm.hardware.festo_cpx.adapter import FestoCpx
from pneuarm.hardware.festo_cpx.emulator import EmulatedCpx
from pneuarm.hardware.festo_cpx.protocol import CpxInputs, CpxLayout, complaint
from pneuarm.hardware.festo_vtem.adapter import FestoVtem
from pneuarm.hardware.festo_vtem.emulator import EmulatedVtem
from pneuarm.hardware.festo_vtem.protocol import (
    ACKNOWLEDGE_COMMAND,
    OFF_COMMAND,
    REGULATE_COMMAND,
    VtemLayout,
    app_and_state,
)
from pneuarm.hardware.transports.modbus import (
    ModbusRefusal,
    ModbusTerminal,
    from_signed,
    milliseconds_to_registers,
    runs,
    to_signed,
)
from pneuarm.hardware.transports.modbus_server import ServedTerminal
from tests.hardware.arms import ARMS
from tests.hardware.festo.festo_bench import WATCHDOG, cpx_settings, vtem_settings

PAPER = ARMS["paper"]
LAYOUT = CpxLayout((0, 1, 2))
SOME_PA = np.array([[2e4, -1e4, 1e4]])


def test_the_registers_of_a_cpx_are_those_of_the_public_drivers() -> None:
    assert LAYOUT.output_blocks([300, 0, 1200]) == [(40003, [300, 0, 1200])]
    assert LAYOUT.input_block == (45395, 9)
    inputs = LAYOUT.decode([301, 300, 0, 0xFFFF, 0, 7, 1199, 1200, 0])
    assert inputs.actual == [301, -1, 1199]
    assert inputs.setpoint == [300, 0, 1200]
    assert inputs.diagnosis == [0, 7, 0]
    assert "valve 1" in complaint(1, 7)
    assert "limit" in complaint(1, 7)
    assert "999" in complaint(0, 999)


def test_valves_of_others_between_ours_are_never_written() -> None:
    layout = CpxLayout((5, 2, 3), output_base=100, input_base=500)
    assert layout.output_blocks([50, 20, 30]) == [(102, [20, 30]), (105, [50])]
    assert layout.input_block == (506, 12)
    registers = list(range(12))
    assert layout.decode(registers).actual == [9, 0, 3]
    assert runs([7, 1, 2, 3, 9, 7]) == [(1, 3), (7, 1), (9, 1)]


@given(st.floats(-1e6, 1e6))
def test_counts_are_the_nearest_no_further_from_ambient(pressure_pa: float) -> None:
    (count,) = counts_of(np.array([pressure_pa]))
    assert abs(count * 100.0) <= abs(pressure_pa) + 1e-3
    assert abs(count * 100.0 - pressure_pa) < 100.0
    assert count == 0 or (count > 0) == (pressure_pa > 0)


@given(st.lists(st.integers(-900, 1200), min_size=3, max_size=3))
def test_whole_millibars_come_back_as_they_went(counts: list[int]) -> None:
    assert counts_of(pressures_of(counts, 1)) == counts
    assert [to_signed(from_signed(count)) for count in counts] == counts


def test_a_time_in_two_registers_has_the_low_word_first() -> None:
    assert milliseconds_to_registers(100, 1) == [100]
    assert milliseconds_to_registers(0x12345, 2) == [0x2345, 0x1]


def test_the_words_of_a_vtem_are_those_of_the_public_driver() -> None:
    assert (REGULATE_COMMAND, ACKNOWLEDGE_COMMAND, OFF_COMMAND) == (195, 126, 61)
    assert app_and_state(131) == (3, 2)
    layout = VtemLayout((0, 1, 2))
    assert layout.output_blocks(195, [10, -20, 30]) == [(40003, [195, 10, 65516, 195, 30, 0])]
    assert layout.input_block == (45395, 6)
    inputs = layout.decode([131, 11, 65515, 61, 31, 0])
    assert inputs.actual == [11, -21, 31]
    assert inputs.slots_not_in(3, 2) == [1]


@contextmanager
def cpx(
    watchdog: TerminalWatchdog = WATCHDOG, hold: bool = False
) -> Iterator[tuple[FestoCpx, ServedTerminal, EmulatedArm]]:
    arm = EmulatedArm(PAPER, 0)
    with ServedTerminal(EmulatedCpx(arm, LAYOUT, watchdog, hold)) as served:
        adapter = FestoCpx(PAPER, cpx_settings(served.port, LAYOUT, watchdog))
        yield adapter, served, arm
        adapter.close()


def test_a_setpoint_of_somebody_else_is_a_fault() -> None:
    with cpx() as (ours, served, _):
        ours.connect()
        for _ in range(8):  # as many as are remembered: the zeros of connecting are forgotten
            ours.write(SOME_PA, 0.0)
        other = FestoCpx(PAPER, cpx_settings(served.port, LAYOUT))
        other.connect()
        ours.read(0.0)
        ours.read(0.0)  # it may only be late
        with pytest.raises(HardwareError, match=r"valve 0 .*\b0 mbar.*\b200 mbar"):
            ours.read(0.0)
        other.close()


def test_a_setpoint_that_shows_late_is_none() -> None:
    with cpx() as (ours, _, _):
        ours.connect()
        for number in range(20):
            ours.write(SOME_PA * number / 20, 0.0)
            late = counts_of(SOME_PA * max(0, number - 3) / 20)
            ours._check_setpoints(CpxInputs([0, 0, 0], late, [0, 0, 0]))


def test_a_terminal_that_would_trap_the_air_is_refused_where_it_shows_it() -> None:
    shown = TerminalWatchdog(46100, 1, 200, failsafe_register=46101)
    with (
        cpx(shown, hold=True) as (ours, _, _),
        pytest.raises(HardwareError, match=r"festo_cpx.* 1 .*46101"),
    ):
        ours.connect()
    with cpx(shown) as (ours, _, _):
        ours.connect()


FAILSAFE_SHOWN = TerminalWatchdog(46100, 1, 400, failsafe_register=46101)


@pytest.mark.parametrize("kind", ["cpx", "vtem"])
@pytest.mark.parametrize(("register", "value"), [(46100, 0), (46100, 60000), (46101, 1)], ids=str)
def test_what_another_program_does_to_the_watchdog_is_seen_within_a_second(
    kind: str, register: int, value: int
) -> None:
    arm = EmulatedArm(PAPER, 0)
    layout = VtemLayout((0, 1, 2))
    terminal = (
        EmulatedCpx(arm, LAYOUT, FAILSAFE_SHOWN)
        if kind == "cpx"
        else EmulatedVtem(arm, layout, FAILSAFE_SHOWN)
    )
    with ServedTerminal(terminal) as served:
        settings = cpx_settings(served.port, LAYOUT, FAILSAFE_SHOWN)
        vtem = replace(vtem_settings(served.port, layout), watchdog=FAILSAFE_SHOWN)
        quick = lambda seconds: time.sleep(0.2 * seconds)  # noqa: E731
        ours = FestoCpx(PAPER, settings) if kind == "cpx" else FestoVtem(PAPER, vtem, quick)
        ours.connect()
        for tick in range(250):
            ours.read(0.01 * tick)
        other = ModbusTerminal("other", "127.0.0.1", served.port, 1, 0.5)
        other.connect()
        other.write(register, [value])

        def read_for_a_second() -> None:
            for tick in range(250, 360):
                ours.read(0.01 * tick)

        with pytest.raises(HardwareError, match=rf"\b{value}\b.*{register}"):
            read_for_a_second()
        other.close()
        if register == 46100:  # a new connection sets it again
            ours.connect()
            assert terminal.read(46100, 1) == [400]
        ours.close()


def test_a_watchdog_of_two_words_is_set_and_runs_out() -> None:
    with cpx(TerminalWatchdog(14000, 2, 300)) as (ours, _, arm):
        ours.connect()
        ours.write(SOME_PA, 0.0)
        time.sleep(0.05)
        np.testing.assert_allclose(arm.setpoints_pa, SOME_PA)
        time.sleep(0.5)
        assert np.array_equal(arm.setpoints_pa, np.zeros((1, 3)))


def test_with_hold_last_state_the_terminal_keeps_the_air() -> None:
    with cpx(hold=True) as (ours, _, arm):
        ours.connect()
        ours.write(SOME_PA, 0.0)
        time.sleep(0.8)
        np.testing.assert_allclose(arm.setpoints_pa, SOME_PA)


@contextmanager
def vtem() -> Iterator[tuple[FestoVtem, EmulatedVtem, list[float]]]:
    layout, slept = VtemLayout((0, 1, 2)), list[float]()

    def sleep(seconds: float) -> None:
        slept.append(seconds)
        time.sleep(0.1 * seconds)

    terminal = EmulatedVtem(EmulatedArm(PAPER, 0), layout, WATCHDOG)
    with ServedTerminal(terminal) as served:
        adapter = FestoVtem(PAPER, vtem_settings(served.port, layout), sleep)
        yield adapter, terminal, slept
        adapter.close()


def test_a_vtem_is_acknowledged_started_and_switched_off() -> None:
    with vtem() as (adapter, terminal, slept):
        adapter.connect()
        assert sum(slept) >= 0.5  # acknowledged, then loaded
        assert {slot.app for slot in terminal._slots} == {3}
        slept.clear()
        adapter.vent(0.0)
        adapter.connect()  # it runs already: nothing to wait for
        assert not slept
        adapter.close()
        assert sum(slept) >= 1.0  # the exhaust
        assert {slot.app for slot in terminal._slots} == {61}


def test_a_slot_that_stops_or_never_starts_is_named() -> None:
    with vtem() as (adapter, terminal, _):
        adapter.connect()
        terminal._slots[1].app = 5
        with pytest.raises(HardwareError, match=r"slot 1 .*app 5"):
            adapter.read(0.0)
        adapter.close()
        terminal._slots[0].command = lambda *_: None  # type: ignore[method-assign]
        with pytest.raises(HardwareError, match=r"slot 0 .* 3 s"):
            adapter.connect()


def test_only_a_missing_register_is_blamed_on_the_wiring() -> None:
    arm = EmulatedArm(PAPER, 0)
    with ServedTerminal(EmulatedCpx(arm, LAYOUT, WATCHDOG)) as served:
        wrong = FestoCpx(PAPER, cpx_settings(served.port, CpxLayout((0, 1, 2), input_base=100)))
        with pytest.raises(HardwareError, match=r"festo_cpx\.input_base = 100"):
            wrong.connect()
        terminal = ModbusTerminal("festo_cpx", "127.0.0.1", served.port, 1, 0.5)
        terminal.connect()
        served.inject("exception 1")
        with pytest.raises(ModbusRefusal) as raised:
            terminal.read_wired(LAYOUT.input_block, "three valves")
        terminal.close()
    assert raised.value.code == 6
    assert "three valves" not in str(raised.value)

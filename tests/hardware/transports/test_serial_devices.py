"""The serial devices beyond the contract: what each refuses, and what a bad line does."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError, HardwareError, InvalidInput
from pneuarm.hardware.channels import Channels
from pneuarm.hardware.ctrl_p.adapter import CtrlP, CtrlPSettings
from pneuarm.hardware.ctrl_p.emulator import CtrlPEmulator
from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.esp32.adapter import Esp32, Esp32Settings
from pneuarm.hardware.esp32.emulator import Esp32Emulator
from pneuarm.hardware.interface import Hardware, Measurement
from pneuarm.hardware.transports.pseudo_terminal import PseudoTerminal, SerialEmulator
from pneuarm.hardware.transports.serial_faults import SerialFaults
from tests.hardware.arms import ARMS
from tools.rig.daemon import wait_for

PAPER = ARMS["paper"]
SOFT = Arm("soft", (replace(PAPER.sections[0], pressure_min_pa=0.0, pressure_max_pa=1.2e4),))
SOME_PA = np.array([[2.0e4, -1.0e4, 3.0e4]])
LOW_PA = np.array([[2.0e3, 4.0e3, 6.0e3]])


@contextmanager
def ctrl_p(
    knows_units: bool = True, fitted: int = 8, **changes: object
) -> Iterator[tuple[CtrlP, CtrlPEmulator, PseudoTerminal]]:
    """A controller of which ``fitted`` channels exist, and an adapter that is not connected."""
    channels = Channels(PAPER, fitted, (0, 2, 4), "valves")
    emulator = CtrlPEmulator(EmulatedArm(PAPER, 0), channels, knows_units)
    with PseudoTerminal(emulator) as terminal:
        settings = CtrlPSettings(str(terminal.path), (0, 2, 4), connect_timeout_s=0.5)
        adapter = CtrlP(PAPER, replace(settings, **changes))  # type: ignore[arg-type]
        yield adapter, emulator, terminal
        adapter.close()


@contextmanager
def esp32(**changes: object) -> Iterator[tuple[Esp32, Esp32Emulator, PseudoTerminal]]:
    """The same for an ESP32 controller."""
    emulator = Esp32Emulator(EmulatedArm(SOFT, 0), Channels(SOFT, 3, (0, 1, 2), "valves"))
    with PseudoTerminal(emulator) as terminal:
        settings = Esp32Settings(str(terminal.path), connect_timeout_s=1.0)
        adapter = Esp32(SOFT, replace(settings, **changes))  # type: ignore[arg-type]
        yield adapter, emulator, terminal
        adapter.close()


def read_for(hardware: Hardware, seconds: float) -> Measurement:
    """Read again and again; return the last reading."""
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        newest = hardware.read(time.monotonic())
    return newest


def error_within(hardware: Hardware, seconds: float) -> str:
    """Read until an error comes; return its text."""
    with pytest.raises(HardwareError) as raised:
        read_for(hardware, seconds)
    return str(raised.value)


@pytest.mark.parametrize("knows_units", [True, False])
def test_a_ctrl_p_that_speaks_another_unit_gets_no_pressure(
    knows_units: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A firmware from before the command, and one that answers with another unit than asked."""
    if knows_units:
        run = CtrlPEmulator._run

        def stubborn(self: CtrlPEmulator, line: str, time_s: float) -> str:
            return run(self, "units;0" if line.startswith("units") else line, time_s)

        monkeypatch.setattr(CtrlPEmulator, "_run", stubborn)
    with ctrl_p(knows_units) as (adapter, emulator, _):
        words = "asked for kPa and answers in psi" if knows_units else "'units;1'"
        with pytest.raises(HardwareError, match=words):
            adapter.connect()
        with pytest.raises(HardwareError, match="not connected"):
            adapter.write(SOME_PA, time.monotonic())
        assert not emulator.arm.setpoints_pa.any()


def test_a_ctrl_p_of_another_size_is_refused_with_both_numbers() -> None:
    """With one value too few the firmware would give the first to every channel."""
    with ctrl_p(fitted=6) as (adapter, emulator, _):
        with pytest.raises(HardwareError, match=r"6 channels.*\[ctrl_p\] channels = 8"):
            adapter.connect()
        assert not emulator.arm.setpoints_pa.any()


def test_channels_without_a_chamber_stay_empty() -> None:
    with ctrl_p() as (adapter, emulator, _):
        adapter.connect()
        adapter.write(SOME_PA, time.monotonic())
        time.sleep(0.05)
        assert emulator._setpoints_kpa == [20.0, 0.0, -10.0, 0.0, 30.0, 0.0, 0.0, 0.0]


def test_an_over_pressure_trip_is_told_and_stays_until_it_is_armed_again() -> None:
    """The controller empties everything; the adapter says so, and why, until it is vented."""
    with ctrl_p() as (adapter, emulator, terminal):
        adapter.connect()
        adapter.write(SOME_PA, time.monotonic())
        assert not read_for(adapter, 0.4).complaints
        with terminal.lock:
            emulator.arm.inject("sensor-offset 1 2.0")
        assert "over-pressure" in error_within(adapter, 1.0)
        assert "reset" in error_within(adapter, 0.1)
        assert not emulator.arm.setpoints_pa.any()
        adapter.vent(time.monotonic())
        assert "over-pressure" in read_for(adapter, 0.1).complaints[0]
        with terminal.lock:
            emulator.arm.inject("clear")
        time.sleep(0.05)
        adapter.write(SOME_PA, time.monotonic())
        assert not read_for(adapter, 0.5).complaints
        np.testing.assert_allclose(emulator.arm.setpoints_pa, SOME_PA)


def test_a_ctrl_p_that_starts_again_is_not_mistaken_for_the_one_before() -> None:
    """It is back in psi, and says nothing until it is asked."""
    with ctrl_p() as (adapter, _, terminal):
        adapter.connect()
        terminal.faults.inject("reset", time.monotonic())
        assert "USB cable" in error_within(adapter, 1.5)
        wait_for(terminal.path.exists, "the device to be back")
        adapter.connect()
        assert np.abs(read_for(adapter, 0.1).pressures_pa).max() < 2e3


def test_a_ceiling_below_the_arms_largest_pressure_is_refused() -> None:
    with (
        pytest.raises(ConfigurationError, match=r"ceiling_bar = 0\.5\b"),
        ctrl_p(ceiling_pa=5e4),
    ):
        pass


class Babbler:
    """A device of another kind on the same port: it never stops, and none of it means anything."""

    def boot(self) -> None:
        """Nothing."""

    def take(self, received: bytes, time_s: float) -> bytes:
        return b""

    def advance(self, time_s: float) -> bytes:
        return b"$GPGGA,no,pressure,at,all\r\n"


def test_a_stream_that_means_nothing_is_shown_as_it_is() -> None:
    """After some lines; a few are tolerated, as the next test shows."""
    babbler: SerialEmulator = Babbler()
    with PseudoTerminal(babbler) as terminal:
        adapter = Esp32(SOFT, Esp32Settings(str(terminal.path), connect_timeout_s=0.3))
        with pytest.raises(HardwareError, match="GPGGA"):
            adapter.connect()
    with ctrl_p() as (adapter, _, terminal):
        adapter.connect()
        terminal.emulator = babbler
        assert "GPGGA" in error_within(adapter, 1.0)


@pytest.mark.parametrize("device", [ctrl_p, esp32])
def test_noise_and_lost_bytes_now_and_then_are_survived(device) -> None:
    """The newest whole lines count; afterwards nothing of it is left."""
    with device() as (adapter, emulator, terminal):
        adapter.connect()
        terminal.faults.inject("half-lines 0.3", time.monotonic())
        read_for(adapter, 0.4)
        terminal.faults.inject("garbage", time.monotonic())
        read_for(adapter, 0.1)
        sent = adapter.write(LOW_PA, time.monotonic())
        read_for(adapter, 0.2)
        np.testing.assert_allclose(emulator.arm.setpoints_pa, sent)


@pytest.mark.parametrize("device", [ctrl_p, esp32])
def test_silence_is_told_after_the_timeout_and_not_before(device) -> None:
    """Shorter than that nothing is said: the measurement only gets older, and says how old."""
    with device() as (adapter, _, terminal):
        adapter.connect()
        read_for(adapter, 0.1)
        terminal.faults.inject("silence 0.25", time.monotonic())
        time.sleep(0.2)
        old = adapter.read(time.monotonic())
        assert old.taken_s is not None
        assert 0.1 < time.monotonic() - old.taken_s < 0.5
        read_for(adapter, 0.2)
        terminal.faults.inject("silence 2", time.monotonic())
        assert " for 0." in error_within(adapter, 1.0)


@pytest.mark.parametrize("device", [ctrl_p, esp32])
def test_setpoints_that_nobody_sent_are_told(device) -> None:
    """Another program on the port, or a command that lost bytes on the way."""
    with device() as (adapter, emulator, terminal):
        adapter.connect()
        adapter.write(LOW_PA, time.monotonic())
        read_for(adapter, 0.2)
        with terminal.lock:
            if isinstance(emulator, CtrlPEmulator):
                emulator.take(b"set;0;5.0\n", time.monotonic())
            else:
                emulator._targets_kpa = [5.0] * 3
        assert "nobody sent" in error_within(adapter, 1.5)
        adapter.vent(time.monotonic())
        read_for(adapter, 0.2)
        assert not emulator.arm.setpoints_pa.any()


@pytest.mark.parametrize("line", [b"maxp;900\n", b"minp;-300\n", b"time;2000\n", b"units;0\n"])
def test_what_was_set_once_on_a_ctrl_p_is_read_back_for_ever(line: bytes) -> None:
    with ctrl_p(timeout_s=5.0) as (adapter, emulator, terminal):
        adapter.connect()
        read_for(adapter, 1.2)
        with terminal.lock:
            emulator.take(line, time.monotonic())
        assert line.split(b";")[0].decode() in error_within(adapter, 5.0)


def test_a_ctrl_p_that_no_longer_says_how_it_is_set_is_told() -> None:
    """Without its echo nothing could be read back, and no trip be seen."""
    with ctrl_p(timeout_s=5.0) as (adapter, emulator, terminal):
        adapter.connect()
        with terminal.lock:
            emulator.take(b"echo;0\n", time.monotonic())
        assert "echo" in error_within(adapter, 6.0)
        adapter.connect()
        read_for(adapter, 0.1)


def test_an_esp32_that_has_begun_to_fill_the_chambers_is_emptied() -> None:
    """After power came it controls lengths, without being asked."""
    with esp32() as (adapter, emulator, _):
        wait_for(lambda: emulator.arm.setpoints_pa.any(), "the controller to fill the chambers")
        adapter.connect()
        assert not emulator.arm.setpoints_pa.any()


def test_a_vent_that_an_esp32_forgot_is_sent_again() -> None:
    """Of two commands in one pass it carries out the first only."""
    with esp32() as (adapter, emulator, _):
        adapter.connect()
        for wait_s in np.linspace(0.0, 0.025, 10):
            adapter.write(LOW_PA, time.monotonic())
            time.sleep(wait_s)
            adapter.vent(time.monotonic())
            assert not emulator.arm.setpoints_pa.any()


def test_lengths_are_those_of_the_potentiometers_that_are_named() -> None:
    """Their mean, in metres; a chamber whose potentiometer is missing has none."""
    with esp32(potentiometers=((1, 4), (2,), (3, 6))) as (adapter, emulator, _):
        adapter.connect()
        adapter.write(LOW_PA, time.monotonic())
        lengths = read_for(adapter, 1.0).lengths_m
        np.testing.assert_allclose(lengths, emulator.arm.lengths_m, atol=5e-4)
        assert np.isfinite(adapter.imu_deg).all()
        assert np.isnan(adapter._lengths_m((200.0, np.nan, 200.0, 200.0, 200.0, 200.0))[0, 1])
    with esp32() as (adapter, _, _):
        adapter.connect()
        assert np.isnan(adapter.read(time.monotonic()).lengths_m).all()


@pytest.mark.parametrize("given", [((1,), (2,)), ((1,), (2,), (7,)), ((1,), (2,), ())])
def test_potentiometers_that_do_not_fit_are_refused(given) -> None:
    with pytest.raises(ConfigurationError, match="potentiometers"):
        Esp32(SOFT, Esp32Settings("nowhere", potentiometers=given))


def test_an_arm_that_an_esp32_cannot_move_is_refused() -> None:
    """With vacuum, with more than 13 kPa, with more than one section."""
    for name, words in (("paper", "-0.9 to 0.9 bar"), ("table1", "0 to 0.13 bar")):
        with pytest.raises(ConfigurationError, match=words):
            Esp32(ARMS[name], Esp32Settings("nowhere"))
    with pytest.raises(ConfigurationError, match="one section"):
        Esp32(Arm("two", SOFT.sections * 2), Esp32Settings("nowhere"))


def test_faults_of_other_transports_are_refused() -> None:
    faults = SerialFaults()
    for words in ("wrong", "exception 1", "half-lines", "half-lines x"):
        with pytest.raises(InvalidInput, match="fault"):
            faults.inject(words, 0.0)

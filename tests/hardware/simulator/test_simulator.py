"""The simulated arm as a device: the interface, its clock, its noise, and what repeats."""

from collections.abc import Iterable

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm, Array, Section
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.interface import Hardware
from pneuarm.hardware.simulator.adapter import SimulatedArm
from pneuarm.hardware.simulator.parameters import SimulatorParameters

SECTION = Section(
    rest_length_m=0.2,
    chamber_offset_m=0.038,
    length_min_m=0.1,
    length_max_m=0.3,
    bend_max_rad=2.618,
    length_rate_max_m_s=0.2,
    length_acceleration_max_m_s2=4.0,
    pressure_min_pa=-9e4,
    pressure_max_pa=9e4,
    pressure_slew_max_pa_s=4e5,
    lengthening_m_per_pa=1.13e-6,
)
PAPER = Arm("paper", (SECTION,))
TRUNK = Arm("trunk", (SECTION,) * 3)
NOMINAL = SimulatorParameters()
BENDING_PA = np.array([[-4e4, 2e4, 3e4]])


def connected(arm: Arm = PAPER, seed: int = 0) -> SimulatedArm:
    """Return a simulated arm, connected and at rest at time zero."""
    simulated = SimulatedArm(arm, NOMINAL, seed)
    simulated.connect()
    simulated.read(0.0)
    return simulated


def tips(simulated: SimulatedArm, times_s: Iterable[float]) -> Array:
    """Tip positions (n, 3) read at the times."""
    positions = []
    for time_s in times_s:
        tip = simulated.read(float(time_s)).true_tip
        assert tip is not None
        positions.append(tip[0])
    return np.array(positions)


def session(simulated: Hardware, ticks: int = 120) -> bytes:
    """Everything an arm answers to one fixed sequence of random commands, as bytes."""
    rng, answers = np.random.default_rng(7), []
    simulated.connect()
    for tick in range(ticks):
        reading = simulated.read(3.0 + tick * 2e-3)
        sent = simulated.write(rng.uniform(-1e5, 1e5, (1, 3)), 3.0 + tick * 2e-3)
        assert reading.true_tip is not None
        answers += [reading.pressures_pa, reading.lengths_m, *reading.true_tip, sent]
    return b"".join(answer.tobytes() for answer in answers)


def test_it_is_a_device_like_any_other() -> None:
    """The Protocol's members, and the shapes and the NaN that a reading promises."""
    hardware: Hardware = connected(TRUNK)
    reading = hardware.read(0.01)
    assert reading.pressures_pa.shape == (3, 3)
    assert np.isnan(reading.lengths_m).all()
    assert reading.lengths_m.shape == (3, 3)
    assert reading.true_tip is not None
    assert reading.true_tip[0].shape == (3,)
    rotation = reading.true_tip[1]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
    assert hardware.write(np.zeros((3, 3)), 0.01).shape == (3, 3)
    hardware.vent(0.01)
    hardware.close()
    hardware.close()


def test_readings_are_not_views_of_each_other() -> None:
    """What was read stays as it was when the arm moves on."""
    simulated = connected()
    simulated.write(BENDING_PA, 0.0)
    first = simulated.read(0.1)
    assert first.true_tip is not None
    kept = [first.pressures_pa.copy(), first.true_tip[0].copy(), first.true_tip[1].copy()]
    simulated.read(0.3)
    for now, then in zip([first.pressures_pa, *first.true_tip], kept, strict=True):
        assert np.array_equal(now, then)


def test_the_first_read_sets_the_clock_and_finds_the_arm_at_rest() -> None:
    """At whatever time: it hangs straight and still, stretched by its weight."""
    simulated = SimulatedArm(PAPER, NOMINAL, 0)
    simulated.connect()
    positions = tips(simulated, 1e6 + np.arange(200) * 5e-3)
    np.testing.assert_allclose(positions - positions[0], 0.0, atol=1e-9)
    np.testing.assert_allclose(positions[0, :2], 0.0, atol=1e-9)
    assert 0.201 < positions[0, 2] < 0.22


def test_the_same_calls_give_the_same_bits() -> None:
    """Invariant 11: a second arm of the seed, and the same arm connected again."""
    simulated = SimulatedArm(PAPER, NOMINAL, 5)
    first = session(simulated)
    assert session(simulated) == first
    assert session(SimulatedArm(PAPER, NOMINAL, 5)) == first
    assert session(SimulatedArm(PAPER, NOMINAL, 6)) != first


def test_sensor_noise_has_the_drawn_size() -> None:
    """2 mbar within the variation, white, on every sensor by itself."""
    simulated = connected()
    readings = np.array([simulated.read(tick * 1e-4).pressures_pa for tick in range(1, 1500)])
    noise = readings.reshape(-1, 3)
    np.testing.assert_allclose(noise.std(axis=0), simulated.drawn.values.sensor_noise_pa, rtol=0.08)
    np.testing.assert_allclose(noise.mean(axis=0), 0.0, atol=25.0)
    assert np.abs(np.corrcoef(noise.T) - np.eye(3)).max() < 0.1


def test_a_late_tick_is_caught_up() -> None:
    """50 ms without a call, and the arm is where punctual reads would have seen it."""
    punctual, late = connected(), connected()
    for simulated in (punctual, late):
        simulated.write(BENDING_PA, 0.0)
        tips(simulated, np.arange(1, 101) * 1e-3)
    moved = tips(punctual, np.arange(101, 151) * 1e-3)
    caught_up = tips(late, [0.15])[0]
    assert np.linalg.norm(moved[-1] - moved[0]) > 5e-3
    np.testing.assert_allclose(caught_up, moved[-1], atol=3e-4)


@pytest.mark.parametrize("bad_time_s", [0.0999, np.nan, np.inf])
def test_a_time_that_runs_backwards_is_refused(bad_time_s: float) -> None:
    """By every call that takes one, after every call that takes one, and nothing is spoilt."""
    simulated = connected()
    calls = (
        simulated.read,
        simulated.vent,
        lambda time_s: simulated.write(np.zeros((1, 3)), time_s),
    )
    for before in calls:
        before(0.1)
        for call in calls:
            with pytest.raises(HardwareError, match="not run back"):
                call(bad_time_s)
    assert np.isfinite(simulated.read(0.1).pressures_pa).all()


def test_it_answers_only_while_connected() -> None:
    """Neither before connect nor after close."""
    simulated = SimulatedArm(PAPER, NOMINAL, 0)
    with pytest.raises(HardwareError, match="not connected"):
        simulated.read(0.0)
    simulated.connect()
    simulated.close()
    with pytest.raises(HardwareError, match="not connected"):
        simulated.write(np.zeros((1, 3)), 0.0)


@pytest.mark.parametrize("command", [np.zeros(3), np.zeros((3, 1)), np.array([[0.0, np.nan, 0.0]])])
def test_a_command_that_is_none_is_refused(command: Array) -> None:
    """Wrong shape or no number: an error that shows it, and the arm goes on."""
    simulated = connected()
    with pytest.raises(HardwareError, match="pressures_pa"):
        simulated.write(command, 0.0)
    assert np.isfinite(simulated.read(1.0).pressures_pa).all()


def test_write_returns_what_the_valves_took() -> None:
    """Inside the range as it is, outside of it the end of the range; the caller's array stays."""
    simulated = connected()
    asked = np.array([[1234.5, 1.5e5, -1.5e5]])
    assert simulated.write(asked, 0.0).tolist() == [[1234.5, 9e4, -9e4]]
    assert asked.tolist() == [[1234.5, 1.5e5, -1.5e5]]
    assert np.abs(simulated.read(2.0).pressures_pa).max() < 9e4 + 5 * 240.0


def test_a_command_acts_as_it_was_when_written() -> None:
    """Changing the array afterwards changes nothing."""
    simulated, asked = connected(), BENDING_PA.copy()
    simulated.write(asked, 0.0)
    asked[:] = 9e4
    pressures_pa = simulated.read(1.0).pressures_pa
    np.testing.assert_allclose(pressures_pa, BENDING_PA, atol=3e3)


def test_venting_brings_the_pressures_to_zero() -> None:
    """Within noise after a second, from any pressure, with a command still under way."""
    simulated = connected()
    simulated.write(np.array([[9e4, -9e4, 5e4]]), 0.0)
    assert np.abs(simulated.read(1.0).pressures_pa).min() > 4e4
    simulated.write(np.array([[-9e4, 9e4, 5e4]]), 1.0)
    simulated.vent(1.001)
    readings = [simulated.read(2.0 + tick * 0.01).pressures_pa for tick in range(100)]
    np.testing.assert_allclose(np.mean(readings, axis=0), 0.0, atol=150.0)

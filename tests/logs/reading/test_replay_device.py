"""A log in the place of a device: the recorded readings in their time, and nothing moves."""

from pathlib import Path

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError, HardwareError
from pneuarm.logs.reading.replay_device import ReplayDevice
from pneuarm.logs.recording.part import Part
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import INFO, STATE
from tools.rig.arms import ARMS

START_NS = 1_800_000_000_000_000_000
PERIOD_NS = 10_000_000


def record(path: Path, arm: Arm, ticks: int, hole_at: int = 1 << 30) -> Path:
    """Write a session of an arm: at tick k chamber c is measured at 10 (k + c) Pa, 0.2 + k um."""
    part = Part(path, arm.name)
    info = pb.Info(
        arm=arm.name,
        length_min_m=arm.per_chamber("length_min_m").reshape(-1).tolist(),
        length_max_m=arm.per_chamber("length_max_m").reshape(-1).tolist(),
        bend_max_rad=arm.per_section("bend_max_rad").reshape(-1).tolist(),
    )
    part.write(INFO, info.SerializeToString(), START_NS)
    for tick in range(ticks):
        stamp_ns = START_NS + tick * PERIOD_NS + (tick >= hole_at) * 86_400 * 10**9
        state = pb.ArmState(
            sequence=tick + 1,
            time_unix_ns=stamp_ns,
            n_sections=arm.n_sections,
            pressure_measured_pa=[10.0 * (tick + c) for c in range(arm.n_chambers)],
            length_measured_m=[0.2 + 1e-6 * tick] * arm.n_chambers,
        )
        part.write(STATE, state.SerializeToString(), stamp_ns, tick + 1)
    part.finish()
    return path


def test_readings_come_in_their_time_from_the_first_on(tmp_path: Path) -> None:
    """Whenever that is; between two ticks it is still the first of them, and its age is told."""
    device = ReplayDevice(ARMS["trunk"], record(tmp_path / "a.mcap", ARMS["trunk"], 100))
    for began_s in (0.0, 1e5):
        device.connect()
        for passed_s, tick in ((0.0, 0), (0.0101, 1), (0.0199, 1), (0.5001, 50), (1.5, 99)):
            reading = device.read(began_s + passed_s)
            expected = 10.0 * (tick + np.arange(9.0).reshape(3, 3))
            np.testing.assert_allclose(reading.pressures_pa, expected)
            np.testing.assert_allclose(reading.lengths_m, 0.2 + 1e-6 * tick)
            assert reading.taken_s == pytest.approx(began_s + tick * 0.01, abs=1e-6)


def test_a_hole_in_the_log_is_skipped(tmp_path: Path) -> None:
    """Of a day: the reading behind it comes right after the one before."""
    device = ReplayDevice(ARMS["paper"], record(tmp_path / "a.mcap", ARMS["paper"], 20, hole_at=10))
    device.connect()
    device.read(5.0)
    pressures = [device.read(5.005 + 0.01 * tick).pressures_pa[0, 0] for tick in range(19)]
    assert pressures == [10.0 * tick for tick in (*range(9), *range(10, 20))]


def test_the_end_of_the_log_is_told(tmp_path: Path) -> None:
    """A log that has ended is no arm at rest."""
    device = ReplayDevice(ARMS["paper"], record(tmp_path / "a.mcap", ARMS["paper"], 10))
    device.connect()
    device.read(5.0)
    with pytest.raises(HardwareError, match=r"ended after 0\.1 s"):
        device.read(7.0)


def test_what_is_written_moves_nothing(tmp_path: Path) -> None:
    device = ReplayDevice(ARMS["paper"], record(tmp_path / "a.mcap", ARMS["paper"], 100))
    device.connect()
    before = device.read(0.5).pressures_pa
    assert device.write(np.full((1, 3), 5e5), 0.5).tolist() == [[0.9e5] * 3]
    device.vent(0.5)
    assert np.array_equal(device.read(0.5).pressures_pa, before)


def test_a_log_of_another_arm_is_refused(tmp_path: Path) -> None:
    """Other lengths, another number of sections, no log at all, a log without a tick."""
    path = record(tmp_path / "a.mcap", ARMS["paper"], 10)
    for name in ("table1", "trunk"):
        with pytest.raises(ConfigurationError, match="is of arm 'paper'"):
            ReplayDevice(ARMS[name], path)
    with pytest.raises(ConfigurationError, match=r"replay\.log: .* cannot be read"):
        ReplayDevice(ARMS["paper"], tmp_path / "none.mcap")
    with pytest.raises(HardwareError, match="no ticks"):
        ReplayDevice(ARMS["paper"], record(tmp_path / "b.mcap", ARMS["paper"], 0)).connect()

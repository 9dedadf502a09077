"""Recorded sessions as what a calibration is fitted to: all of it that a live one has."""

from pathlib import Path

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.rings.tick import new_tick
from pneuarm.service.calibration.recordings import read_logs, recording_of
from pneuarm.service.configuration.configuration import load
from pneuarm.service.replay.command import recorded_configuration
from tools.rig.recording import PERIOD_NS, START_NS, Session, make_session

TURNED_XYZW = np.array([0.0, 0.6, 0.0, 0.8])


def tip_m(number: int) -> Array:
    return np.array([1e-4 * number, 0.0, 0.2])


def write_measured(session: Session, count: int) -> None:
    """Ticks of a camera that sees every pose 10 ms late."""
    for number in range(count):
        tick = new_tick(1)
        tick["sequence"] = session._ticks.last_sequence + 1
        tick["time_unix_ns"] = START_NS + number * PERIOD_NS
        tick["pressure_sent_pa"] = tick["pressure_measured_pa"] = 1e3 * number
        tick["tip_measured_position_m"] = tip_m(number)
        tick["tip_measured_orientation_xyzw"] = TURNED_XYZW
        tick["tip_measured_age_s"] = 0.01
        session._ticks.write(tick.tobytes())


def closed(session: Session) -> Path:
    recorder = session.recorder()
    session.flush(recorder)
    recorder.finish()
    return session.path


def test_a_log_gives_what_its_ticks_give(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session = make_session(tmp_path, monkeypatch)
    session.info.config_toml = load().to_toml()
    write_measured(session, 300)
    path = closed(session)
    configuration, recording = read_logs([path], None)
    whole = recording_of(LogReader(path).ticks())
    assert configuration.arm == load().arm
    for name in ("time_s", "sent_pa", "measured_pa", "tip_m", "tip_rotation"):
        np.testing.assert_array_equal(getattr(recording, name), getattr(whole, name))
    rotations = recording.tip_rotation
    assert rotations is not None
    np.testing.assert_allclose(rotations[:, 0, 2], 2.0 * 0.6 * 0.8)
    np.testing.assert_allclose(recording.tip_m[20], tip_m(20 * 5 + 5), atol=1e-4)


def test_a_log_whose_configuration_is_of_other_sections_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = make_session(tmp_path, monkeypatch)
    session.info.config_toml = load(preset="trunk").to_toml()
    write_measured(session, 50)
    path = closed(session)
    for read in (lambda: read_logs([path], None), lambda: recorded_configuration(LogReader(path))):
        with pytest.raises(LogError) as refused:
            read()
        told = str(refused.value)
        assert all(fact in told for fact in (str(path), "3 sections", "1"))
        assert "\n" not in told

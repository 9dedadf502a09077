"""Ticks, live or from logs, as what a calibration is fitted to."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import CalibrationError, ConfigurationError, LogError
from pneuarm.controllers.calibration.recording import Recording, fresh_tips, joined
from pneuarm.controllers.geometry.rotations import rotation_from_quaternion
from pneuarm.logs.reading.reader import LogReader
from pneuarm.service.configuration.configuration import Configuration, recorded

#: What is needed of a tick; all of them, of hours, would fill the memory.
_NEEDED = (
    "time_unix_ns",
    "pressure_sent_pa",
    "pressure_measured_pa",
    "tip_measured_position_m",
    "tip_measured_orientation_xyzw",
    "tip_measured_age_s",
)

#: Samples are this far apart, as on the wire.
SAMPLE_S = 0.01


def recording_of(ticks: np.ndarray) -> Recording:
    """Recording of ticks (see :mod:`pneuarm.logs.rings.tick`) thinned to 100 a second, by the tip.

    A tip pose is put where it was received, not where the tick read it.
    """
    time_s = (ticks["time_unix_ns"] - ticks["time_unix_ns"][0]) * 1e-9
    kept = np.flatnonzero(np.diff(np.floor(time_s / SAMPLE_S + 1e-6), prepend=-1.0) > 0.0)
    ticks, time_s = ticks[kept], time_s[kept]
    age_s = np.nan_to_num(ticks["tip_measured_age_s"])
    tips = fresh_tips(ticks["tip_measured_position_m"], age_s)
    seen = np.asarray(np.isfinite(tips).all(axis=1))
    if seen.any():
        times = np.maximum.accumulate(time_s[seen] - age_s[seen])
        columns = [np.interp(time_s, times, column) for column in tips[seen].T]
        tips = np.where(seen[:, None], np.stack(columns, axis=1), np.nan)
    turned = ticks["tip_measured_orientation_xyzw"]
    rotations = np.moveaxis(rotation_from_quaternion(turned.T), -1, 0)
    return Recording(
        time_s, ticks["pressure_sent_pa"], ticks["pressure_measured_pa"], tips, rotations
    )


def read_logs(paths: Sequence[Path], name: str | None) -> tuple[Configuration, Recording]:
    """Recording of sessions of one arm, and the configuration of the first.

    Raises LogError for what is no session, and for one of another arm than ``name`` or the first.
    """
    readers = [LogReader(path) for path in paths]
    configurations = [_configuration(reader) for reader in readers]
    first = configurations[0].build_arm()
    for path, configuration in zip(paths, configurations, strict=True):
        _require_same(path, configuration.build_arm(), first, name)
    recordings = []
    for path, reader in zip(paths, readers, strict=True):
        ticks = reader.ticks(_NEEDED)
        if not len(ticks) or not np.isfinite(ticks["tip_measured_position_m"]).any():
            raise LogError(
                f"{path} holds no measured tip pose: a calibration needs motion capture that "
                "publishes on sensor/tip_pose while the session is recorded"
            )
        recordings.append(recording_of(ticks))
    return configurations[0], joined(recordings)


def _configuration(reader: LogReader) -> Configuration:
    path = reader.parts[0]
    try:
        configuration = recorded(reader.info.config_toml, str(path))
    except ConfigurationError as error:
        raise LogError(f"{path} holds a configuration that is not read here: {error}") from error
    if len(configuration.arm.sections) != reader.n_sections:
        raise LogError(
            f"{path} is damaged: its configuration is of {len(configuration.arm.sections)} "
            f"sections, its facts are of {reader.n_sections}"
        )
    return configuration


def _require_same(path: Path, arm: Arm, first: Arm, name: str | None) -> None:
    wanted = name or first.name
    if arm.name != wanted:
        raise LogError(f"{path} is a session of arm {arm.name!r}, not of {wanted!r}")
    if arm.n_sections != first.n_sections:
        raise LogError(
            f"{path} is a session of {arm.n_sections} sections, the first log has "
            f"{first.n_sections}; all logs must be of one arm"
        )
    if arm != first:
        raise LogError(
            f"{path} was recorded with another configuration of arm {arm.name!r} than the first "
            "log; calibrate from logs with the same [arm] table"
        )


def require_seen(recording: Recording) -> None:
    """Raise CalibrationError where the tip was not measured for most of the time."""
    share = float(np.isfinite(recording.tip_m).all(axis=1).mean())
    if share < 0.8:
        raise CalibrationError(
            f"the tip was measured only {100.0 * share:.0f} % of the time: see that the marker "
            "stays in view of the cameras, and calibrate again"
        )

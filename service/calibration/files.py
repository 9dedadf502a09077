"""calibration.toml: the daemon's effective configuration with the fitted values in place."""

import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from pneuarm.controllers.arm.arm import Array, Response, Section
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.controllers.calibration.calibrate import Calibration
from pneuarm.controllers.calibration.frames import Frames
from pneuarm.controllers.geometry.mountings import Transform
from pneuarm.controllers.geometry.rotations import rotation_vector
from pneuarm.hardware.tables.table import BAR, DEG, MM
from pneuarm.service.calibration.values import residuals_text, value_text, values, worth_text
from pneuarm.service.configuration.configuration import Configuration, check
from pneuarm.service.configuration.tables.frames import FramesConfig

#: Name of a capture system that had none before its frame was found.
MOCAP_FRAME = "mocap"

_DIGITS = 7


def calibrated(configuration: Configuration, calibration: Calibration) -> Configuration:
    """Return the configuration with the fitted values, and with the frames if they were fitted.

    A simulated arm stays what it was: its device goes on with the arm from before.
    """
    tables = configuration.model_dump(exclude_none=True)
    if configuration.is_simulated and configuration.simulated.arm is None:
        tables[configuration.device.table]["arm"] = configuration.arm.model_dump()
    sections = zip(tables["arm"]["sections"], calibration.arm.sections, strict=True)
    tables["arm"]["sections"] = [old | _section(section) for old, section in sections]
    tables["arm"]["response"] |= _response(calibration.arm.response)
    if calibration.fit.in_world:
        tables["frames"] |= frames_table(configuration.frames, calibration.fit.frames)
    return check(tables, "calibration.toml")


def _section(section: Section) -> dict[str, Any]:
    coupling = np.round(np.array(section.coupling), _DIGITS)
    return {
        "rest_length_mm": _rounded(section.rest_length_m / MM),
        "chamber_offset_mm": _rounded(section.chamber_offset_m / MM),
        "lengthening_mm_per_bar": _rounded(section.lengthening_m_per_pa * BAR / MM),
        "softening_mm_per_bar2": _rounded(section.softening_m_per_pa2 * BAR**2 / MM),
        "coupling": coupling.tolist(),
        "hysteresis_bar": _rounded(section.hysteresis_pa / BAR),
        "bending_compliance_deg_per_n_m": _rounded(section.bending_compliance_rad_per_n_m / DEG),
        "axial_compliance_mm_per_n": _rounded(section.axial_compliance_m_per_n / MM),
    }


def _response(response: Response) -> dict[str, float]:
    return {
        "delay_ms": _rounded(response.delay_s * 1e3),
        "filling_lag_ms": _rounded(response.filling_lag_s * 1e3),
        "exhausting_lag_ms": _rounded(response.exhausting_lag_s * 1e3),
        "mode_hz": _rounded(response.mode_hz),
        "damping_ratio": _rounded(response.damping_ratio),
    }


def frames_table(before: FramesConfig, found: Frames) -> dict[str, Any]:
    """Keys of ``[frames]`` with which the poses that were measured are those of the arm's tip.

    They were measured through the frames of ``before``: in the capture system's if it had a name,
    else as if it were the base.
    """
    known = before.frames()
    seen = known.mocap_to_base if before.mocap_frame else Transform()
    mocap = Transform(found.rotation, found.translation_m).inverse() @ seen
    tip = known.tip_to_marker @ Transform(position_m=-found.marker_m)
    return {
        "mocap_frame": before.mocap_frame or MOCAP_FRAME,
        "mocap_position_mm": _triple(mocap.position_m / MM),
        "mocap_rotation_deg": _triple(np.rad2deg(rotation_vector(mocap.rotation))),
        "tip_in_marker_position_mm": _triple(tip.position_m / MM),
    }


def _triple(values: Array) -> tuple[float, ...]:
    return tuple(_rounded(value) for value in values.tolist())


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")


def toml_text(configuration: Configuration, calibration: Calibration) -> str:
    """Text of the file: date, arm and residuals in comments, then the whole configuration."""
    when = time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime())
    lines = [
        f"Calibration of arm {configuration.arm.name}, {when}: {residuals_text(calibration)}.",
        f"Worth: {worth_text(calibration)}.",
        *([f"Note: {calibration.note}."] if calibration.note else []),
        "Run it with `pneuarm run calibration.toml`. Fitted, with standard deviations:",
        *(f"  {value_text(value)}" for value in values(calibration)),
    ]
    comments = "".join(f"# {line}\n" for line in lines)
    return f"{comments}\n{calibrated(configuration, calibration).to_toml()}"


def require_folder(folder: Path) -> None:
    """Make the folder, before the arm moves for nothing; raises ConfigurationError."""
    write_whole(folder / ".calibration", "")
    (folder / ".calibration").unlink()


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file that is there whole or not at all; raises ConfigurationError."""
    beside = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        beside.write_bytes(content.encode() if isinstance(content, str) else content)
        os.replace(beside, path)
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be written: {error.strerror}") from error

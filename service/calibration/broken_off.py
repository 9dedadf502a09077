"""A calibration that was broken off: what was moved and recorded, kept for `--resume`."""

import contextlib
import tomllib
from io import BytesIO
from pathlib import Path

import numpy as np

from pneuarm.controllers.arm.errors import CalibrationError
from pneuarm.controllers.calibration.recording import Recording
from pneuarm.service.calibration.drive import Progressed
from pneuarm.service.calibration.files import write_whole
from pneuarm.service.configuration.configuration import Configuration, check

NAME = "calibration-broken-off.npz"

_FIELDS = ("time_s", "sent_pa", "measured_pa", "tip_m", "tip_rotation")


def save(folder: Path, configuration: Configuration, so_far: Progressed) -> None:
    """Keep what was recorded, if anything was."""
    if not so_far.moves_done or not so_far.pieces:
        return
    recording, file = so_far.recording, BytesIO()
    np.savez_compressed(
        file,
        moves_done=so_far.moves_done,
        config_toml=configuration.to_toml(),
        **{name: getattr(recording, name) for name in _FIELDS},
    )
    write_whole(folder / NAME, file.getvalue())


def load(folder: Path, configuration: Configuration) -> Progressed:
    """Return what was kept in a folder; raises CalibrationError where it does not go with the arm.

    The motion follows from the arm: only one of the same configuration can go on with it.
    """
    path = folder / NAME
    try:
        with np.load(path, allow_pickle=False) as kept:
            recording = Recording(*(kept[name] for name in _FIELDS))
            moves_done, text = int(kept["moves_done"]), str(kept["config_toml"])
            arm = check(tomllib.loads(text), str(path)).arm
    except FileNotFoundError:
        raise CalibrationError(
            f"there is no broken-off calibration in {folder} ({NAME}): calibrate without --resume, "
            "or name its folder with --out"
        ) from None
    except Exception as error:  # damaged bytes: there is nothing that the libraries do not raise
        raise CalibrationError(
            f"{path} is damaged ({type(error).__name__}: {' '.join(str(error).split())[:200]}); "
            "calibrate without --resume"
        ) from error
    if arm != configuration.arm:
        raise CalibrationError(
            f"{path} was recorded with another [arm] than the daemon's now; start the daemon with "
            "that configuration, or calibrate without --resume"
        )
    return Progressed(moves_done, [recording])


def remove(folder: Path) -> None:
    """Nothing is broken off any more."""
    with contextlib.suppress(FileNotFoundError):
        (folder / NAME).unlink()

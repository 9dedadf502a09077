"""What was learnt, in a TOML file as every other of an arm: to be read, compared and kept by hand.

It says of which arm, configuration and trajectory it is, and fits no other.
"""

import hashlib
import json
import time
import tomllib
from pathlib import Path
from typing import Annotated

import numpy as np
import tomli_w
from pydantic import Field, ValidationError

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import InvalidInput, LearningError
from pneuarm.controllers.learning.learning import Learning
from pneuarm.controllers.targets.trajectory import MAX_WAYPOINTS
from pneuarm.hardware.tables.table import MM, Finite, NotNegative, Table
from pneuarm.logs.schema.printable import printable
from pneuarm.service.calibration.files import require_folder, write_whole
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.configuration.text_file import read_text

_Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class TrialRow(Table):
    """How far the measured tip was from the wanted one in a trial, the first without anything."""

    rms_mm: NotNegative
    max_mm: NotNegative


class Learned(Table):
    """The file. ``offsets`` has a row a waypoint: time in s, then x y z in mm."""

    arm: str
    trajectory: str
    trajectory_sha256: _Digest
    configuration_sha256: _Digest
    advance_s: NotNegative
    cutoff_hz: NotNegative
    trials: list[TrialRow]
    offsets: Annotated[
        list[Annotated[list[Finite], Field(min_length=4, max_length=4)]],
        Field(min_length=2, max_length=MAX_WAYPOINTS),
    ]

    @property
    def offset_m(self) -> Array:
        """Offsets (waypoints, 3)."""
        return MM * np.array(self.offsets)[:, 1:]


#: What the tip's motion follows from, for a trajectory: with another one it goes another way.
_MOVES: dict[str, bool | set[str]] = {
    "arm": True,
    "frames": True,
    "reference": True,
    "feedback": True,
    "control": {"law", "gain_per_s", "tip_speed_max_mm_s"},
    "hardware": {"adapter"},
}
_BOUND = {"feedback": {"learned_max_share"}}


def configuration_digest(configuration: Configuration) -> str:
    """SHA-256 of what the tip's motion follows from: arm and frames, law, correction, device.

    Of the device it is the kind; of a simulated one everything, as another seed is another arm.
    """
    tables = configuration.model_dump(mode="json", include=_MOVES, exclude=_BOUND)
    if configuration.is_simulated:
        tables["simulated"] = configuration.simulated.model_dump(mode="json")
    return hashlib.sha256(json.dumps(tables, sort_keys=True).encode()).hexdigest()


def require_place(path: Path) -> None:
    """Make the folder, and leave alone what is there and is not ours, before the arm moves.

    Raises ConfigurationError where nothing can be written, InvalidInput where another file is.
    """
    require_folder(path.parent)
    if not path.exists():
        return
    try:
        load(path)
    except InvalidInput as error:
        raise InvalidInput(
            f"{path} is there already, and no file that `pneuarm learn` has written: it is left as "
            "it is; name another one with --output"
        ) from error


def save(path: Path, name: str, learning: Learning, configuration: Configuration) -> None:
    """Write the best trial's offsets, whole or not at all; ``name`` is that of the trajectory."""
    law = learning.law
    if law is None:
        raise LearningError("no trial was gone through, so there is nothing to keep")
    course, best = learning.course, learning.best
    head = {
        "arm": configuration.arm.name,
        "trajectory": name,
        "trajectory_sha256": course.digest,
        "configuration_sha256": configuration_digest(configuration),
        "advance_s": round(law.advance_s, 4),
        "cutoff_hz": round(law.cutoff_hz, 4),
    }
    trials = [
        {"rms_mm": round(trial.rms_m / MM, 4), "max_mm": round(trial.max_m / MM, 4)}
        for trial in learning.trials
    ]
    rows = np.column_stack([course.waypoint_times_s, course.at_waypoints(best.offset_m) / MM])
    offsets = "".join(f"    [{', '.join(f'{value:.4f}' for value in row)}],\n" for row in rows)
    when = time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime())
    write_whole(
        path,
        f"# Learnt by repeating, {when}: RMS {learning.trials[0].rms_m / MM:.2f} mm before, "
        f"{best.rms_m / MM:.2f} mm with it.\n"
        f"# pneuarm send trajectory {printable(name)} --learned {printable(path.name)} --enable\n\n"
        f"{tomli_w.dumps(head)}\n# Time in s, then x y z in mm: what is added to the wanted tip.\n"
        f"offsets = [\n{offsets}]\n\n{tomli_w.dumps({'trials': trials})}",
    )


def load(path: Path) -> Learned:
    """Read what was learnt; raises InvalidInput with the key that is wrong."""
    try:
        return Learned.model_validate(tomllib.loads(read_text(path)))
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(step) for step in first["loc"]) or "file"
        what = f"{key}: {first['msg'][0].lower()}{first['msg'][1:]}"
    except (ValueError, RecursionError) as error:
        if isinstance(error, InvalidInput):
            raise
        what = str(error).splitlines()[0]
    raise InvalidInput(
        f"{path} is no file that `pneuarm learn` has written: {what}; learn the trajectory again"
    )

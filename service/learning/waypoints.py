"""The file of a trajectory, as `pneuarm send trajectory` and `pneuarm learn` take it."""

import math
from pathlib import Path

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.hardware.tables.table import MM
from pneuarm.service.configuration.text_file import read_text


def read_waypoints(path: Path) -> list[tuple[float, list[float]]]:
    """Read lines of time (s) and position (mm), separated by commas or blanks.

    Lines that begin with # are left out. Raises InvalidInput with the line that is wrong.
    """
    waypoints = []
    for number, line in enumerate(read_text(path).splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            time_s, x, y, z = _finite(line)
        except ValueError:
            raise InvalidInput(
                f"{path}, line {number}: {line[:80]!r}; four numbers are needed: time in s, then "
                "x y z in mm"
            ) from None
        waypoints.append((time_s, [MM * x, MM * y, MM * z]))
    if not waypoints:
        raise InvalidInput(f"{path} holds no waypoints; a line is: time in s, then x y z in mm")
    return waypoints


def _finite(line: str) -> list[float]:
    """Numbers of a line; raises ValueError for what is none, or not finite."""
    values = [float(word) for word in line.replace(",", " ").split()]
    if not all(map(math.isfinite, values)):
        raise ValueError
    return values

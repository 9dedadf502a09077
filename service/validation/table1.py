"""Table 1 of the paper: its arm identified from it, and its columns computed again.

The paper gives neither ``d`` nor the rest length of its arm. The two constant-curvature columns
do: ``theta = 2 atan2(y, z)`` and ``L = z theta / sin(theta)`` for each row; with two chambers
lengthened by DL, ``theta = 2 DL / (3 d)`` and ``L = l0 + 2 DL / 3``, so ``L = l0 + d theta``: a
line through the rows gives both. ``DL = 3/2 d theta`` over the pressure is then fitted by
``a p + b p^2``. All by least squares; nothing measured enters.
"""

import csv
from collections.abc import Callable
from dataclasses import dataclass
from decimal import ROUND_DOWN, Decimal, InvalidOperation
from importlib.resources import files
from pathlib import Path

import numpy as np

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm, Array, Section
from pneuarm.controllers.arm.errors import ConfigurationError, InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import section_inverse, tip_transform
from pneuarm.service.configuration.text_file import read_text

MM, BAR = 1e-3, 1e5
#: The experiment lengthens two chambers: the arm bends toward the third, here along x.
DRIVEN = np.array([0.0, 1.0, 1.0])

COLUMNS = (
    "pressure_bar",
    "y_measured_mm",
    "z_measured_mm",
    "y_cc_mm",
    "z_cc_mm",
    "error_y_percent",
    "error_z_percent",
)


@dataclass(frozen=True)
class PrintedTable:
    """Its rows as printed: a Decimal keeps the digits, ``(n_rows,)`` a column."""

    printed: dict[str, tuple[Decimal, ...]]

    def column(self, name: str, unit: float = 1.0) -> Array:
        """Return a column (n_rows,) times ``unit``: MM gives metres."""
        return np.array([float(value) for value in self.printed[name]]) * unit

    def cut_errors_percent(self, axis: str) -> tuple[Decimal, ...]:
        """Errors of ``axis`` ("y", "z") from the table's own millimetres, in its own digits.

        ``|measured - computed| / computed`` in percent, cut off after as many digits as the table
        prints: it cuts, it does not round (12.80 % is 12.8, 9.91 % is 9).
        """
        columns = (f"{axis}_measured_mm", f"{axis}_cc_mm", f"error_{axis}_percent")
        rows = zip(*(self.printed[name] for name in columns), strict=True)
        return tuple(
            (100 * abs(measured - computed) / computed).quantize(shown, rounding=ROUND_DOWN)
            for measured, computed, shown in rows
        )


@dataclass(frozen=True)
class IdentifiedArm:
    """What table 1 says of its arm: lengths in m, the map in m/Pa and m/Pa^2."""

    rest_length_m: float
    chamber_offset_m: float
    lengthening_m_per_pa: float
    softening_m_per_pa2: float

    def arm(self) -> Arm:
        """Return the arm with these numbers; the limits are the preset's."""
        section = Section(
            rest_length_m=self.rest_length_m,
            chamber_offset_m=self.chamber_offset_m,
            length_min_m=0.5 * self.rest_length_m,
            length_max_m=1.5 * self.rest_length_m,
            bend_max_rad=0.5 * np.pi,
            length_rate_max_m_s=0.2,
            length_acceleration_max_m_s2=4.0,
            pressure_min_pa=0.0,
            pressure_max_pa=1.2 * BAR,
            pressure_slew_max_pa_s=6.0 * BAR,
            lengthening_m_per_pa=self.lengthening_m_per_pa,
            softening_m_per_pa2=self.softening_m_per_pa2,
        )
        return Arm("table1", (section,))

    def lengths_m(self, pressures_pa: Array) -> Array:
        """Chamber lengths (n, 1, 3) for pressures (n,) in the two driven chambers."""
        return PressureMap(self.arm()).lengths_m(pressures_pa[:, None, None] * DRIVEN)

    def tip_m(self, pressures_pa: Array) -> Array:
        """Tip (n, 2) by constant curvature: sideways y and along the arm z, m."""
        tips = tip_transform(self.arm(), self.lengths_m(pressures_pa))[:, :3, 3]
        return tips[:, [0, 2]]


def read_table(path: Path | None = None) -> PrintedTable:
    """Read table 1, the packaged one or a file like it.

    Raises ConfigurationError for a file that cannot be read, other columns, a value that is no
    number above zero, or less than three rows.
    """
    source = path or files("pneuarm.service.validation").joinpath("table1.csv")
    try:
        text = source.read_text() if path is None else read_text(path)
        rows = list(csv.DictReader(text.splitlines()))
    except (InvalidInput, csv.Error) as error:
        raise ConfigurationError(f"{source}: {error}") from error
    if not rows or tuple(rows[0]) != COLUMNS:
        found = ", ".join(str(key) for key in rows[0]) if rows else "no rows"
        raise ConfigurationError(f"{source}: found {found}; the columns are {', '.join(COLUMNS)}")
    if len(rows) < 3:
        raise ConfigurationError(f"{source} has {len(rows)} rows; a fit on two needs 3 or more")
    for index, row in enumerate(rows):
        if None in row:  # where csv puts what is beyond the last column
            raise ConfigurationError(
                f"{source}: row {index + 1} has more values than the {len(COLUMNS)} columns"
            )
    number = _reader(str(source))
    return PrintedTable(
        {name: tuple(number(i, name, row[name]) for i, row in enumerate(rows)) for name in COLUMNS}
    )


def _reader(where: str) -> Callable[[int, str, str | None], Decimal]:
    def number(index: int, name: str, text: str | None) -> Decimal:
        try:
            value = Decimal(text or "")
        except InvalidOperation:
            value = Decimal("NaN")
        if not (value.is_finite() and value > 0):
            raise ConfigurationError(
                f"{where}: row {index + 1}, {name} = {text!r}: it must be a number above 0"
            )
        return value

    return number


def identify(table: PrintedTable) -> IdentifiedArm:
    """Identify the arm from the constant-curvature columns, see the module's text."""
    y, z = table.column("y_cc_mm", MM), table.column("z_cc_mm", MM)
    length, theta, _ = section_inverse(np.stack([y, 0.0 * y, z], axis=-1)).T
    offset, rest = np.polyfit(theta, length, 1)
    pressure = table.column("pressure_bar")
    powers = np.stack([pressure, pressure**2], axis=-1)
    (linear, quadratic), *_ = np.linalg.lstsq(powers, 1.5 * offset * theta, rcond=None)
    return IdentifiedArm(float(rest), float(offset), float(linear) / BAR, float(quadratic) / BAR**2)

"""`pneuarm validate table1`: one object for programs, one table for people."""

import argparse
import json
from typing import Any

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.service.validation.gravity import CrossValidation, cross_validate, measured_m
from pneuarm.service.validation.table1 import (
    BAR,
    MM,
    IdentifiedArm,
    PrintedTable,
    identify,
    read_table,
)


def validate(arguments: argparse.Namespace) -> int:
    """Print table 1 computed again: positions in mm as y / z, errors in percent."""
    report = table1_report(read_table(arguments.table))
    if arguments.json:
        print(json.dumps(report))
        return 0
    cells = table_cells(report)
    widths = [max(len(line[column]) for line in cells) for column in range(len(cells[0]))]
    print("Tip as y / z in mm, two chambers under pressure")
    for line in cells:
        print("  ".join(text.rjust(width) for text, width in zip(line, widths, strict=True)))
    print(parameters_text(report))
    return 0


def table1_report(table: PrintedTable) -> dict[str, Any]:
    """Return ``{"rows": [...], "parameters": {...}}``, in mm, bar and percent."""
    arm, gravity = identify(table), cross_validate(table)
    return {"rows": _rows(table, arm, gravity), "parameters": _parameters(arm, gravity)}


def _rows(
    table: PrintedTable, arm: IdentifiedArm, gravity: CrossValidation
) -> list[dict[str, Any]]:
    pressures = table.column("pressure_bar", BAR)
    measured, computed = measured_m(table), arm.tip_m(pressures)
    columns: dict[str, Array] = {"pressure_bar": pressures / BAR}
    columns |= _pair("measured_mm", measured / MM)
    columns |= _pair("cc_mm", computed / MM)
    columns |= _errors("percent", np.abs(100.0 * (measured / computed - 1.0)))
    columns |= _errors("percent_from_table_mm", _from_table(table))
    columns |= _pair("gravity_mm", gravity.predicted_m / MM)
    columns |= _errors("percent_gravity", np.abs(gravity.errors_percent(table)))
    for axis in ("y", "z"):
        columns[f"{axis}_cc_printed_mm"] = table.column(f"{axis}_cc_mm")
        columns[f"error_{axis}_percent_printed"] = table.column(f"error_{axis}_percent")
    rows: list[dict[str, Any]] = [
        {name: round(float(values[index]), 6) for name, values in columns.items()}
        for index in range(len(pressures))
    ]
    for row, fit in zip(rows, gravity.fits, strict=True):
        row["weight_over_bending_per_m2"] = round(fit.weight_over_bending_per_m2, 4)
        row["length_zero_mm"] = round(fit.length_zero_m / MM, 4)
    return rows


def _pair(suffix: str, values: Array) -> dict[str, Array]:
    return {f"y_{suffix}": values[:, 0], f"z_{suffix}": values[:, 1]}


def _errors(suffix: str, values: Array) -> dict[str, Array]:
    return {f"error_y_{suffix}": values[:, 0], f"error_z_{suffix}": values[:, 1]}


def _from_table(table: PrintedTable) -> Array:
    cut = [[float(value) for value in table.cut_errors_percent(axis)] for axis in ("y", "z")]
    return np.array(cut).T


def _parameters(arm: IdentifiedArm, gravity: CrossValidation) -> dict[str, float]:
    return {
        "rest_length_mm": round(arm.rest_length_m / MM, 4),
        "chamber_offset_mm": round(arm.chamber_offset_m / MM, 4),
        "lengthening_mm_per_bar": round(arm.lengthening_m_per_pa * BAR / MM, 4),
        "softening_mm_per_bar2": round(arm.softening_m_per_pa2 * BAR**2 / MM, 4),
        "weight_over_bending_per_m2": round(gravity.all_rows.weight_over_bending_per_m2, 4),
        "length_zero_mm": round(gravity.all_rows.length_zero_m / MM, 4),
    }


#: Heading, first key, second key, digits: a column of the table for people is a pair y / z.
_COLUMNS = (
    ("measured", "y_measured_mm", "z_measured_mm", 1),
    ("constant curvature", "y_cc_mm", "z_cc_mm", 1),
    ("error %", "error_y_percent", "error_z_percent", 1),
    ("with gravity", "y_gravity_mm", "z_gravity_mm", 1),
    ("error %", "error_y_percent_gravity", "error_z_percent_gravity", 2),
)


def table_cells(report: dict[str, Any]) -> list[list[str]]:
    """Return the table as cells of text, the heading first."""
    lines = [["bar", *(heading for heading, *_ in _COLUMNS)]]
    for row in report["rows"]:
        pairs = (f"{row[y]:.{digits}f} / {row[z]:.{digits}f}" for _, y, z, digits in _COLUMNS)
        lines.append([f"{row['pressure_bar']:g}", *pairs])
    return lines


def parameters_text(report: dict[str, Any]) -> str:
    """Return the identified numbers in two sentences."""
    p = report["parameters"]
    return (
        f"Identified: l0 {p['rest_length_mm']:.2f} mm, d {p['chamber_offset_mm']:.2f} mm, "
        f"lengthening {p['lengthening_mm_per_bar']:.2f} mm/bar and "
        f"{p['softening_mm_per_bar2']:.2f} mm/bar^2. With gravity, from all rows: weight over "
        f"bending stiffness {p['weight_over_bending_per_m2']:.1f} per m^2, zero of the length "
        f"{p['length_zero_mm']:+.2f} mm; each row above is predicted by the fit on the others."
    )

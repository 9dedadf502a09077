"""Writes docs/validation.md: ``python -m tools.validation.report [--out DIR]``, `make validate`.

Every section is a function without arguments that returns its Markdown; the pictures lie beside
the document in ``images/``.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

from pneuarm.service.validation.command import parameters_text, table1_report, table_cells
from pneuarm.service.validation.table1 import read_table
from tools.validation import figures_kinematics, figures_workspace
from tools.validation.finite_elements import report as finite_elements
from tools.validation.markdown import markdown_table
from tools.validation.models import compare
from tools.validation.models_picture import draw
from tools.validation.models_report import (
    errors_table,
    failures_table,
    paper_arm,
    table1_weight_over_bending_per_m3,
)

#: A section returns its Markdown, its title first, without an empty line at the end.
Section = Callable[[], str]

_DOCUMENT = "validation.md"
_PICTURES = "images"
_MODELS_PICTURE = "models.png"
_SAMPLES = 1000
_HEAD = """# Validation

The paper's sections 4 and 5 computed again, and where the model ends. Everything here is written
by `make validate`; nothing is typed in. "The paper" is *Kinematic Modeling of a Spatial Soft Robot
by an Improved Analytical Method Based on Serial Robots*."""


def table1() -> str:
    """The paper's table 1 from the pressures alone."""
    report = table1_report(read_table())
    heading = ["bar", "y / z computed, mm", "printed, mm", "error %", "printed %", "cut %"]
    keys = (
        ("{}_cc_mm", ".2f"),
        ("{}_cc_printed_mm", ".1f"),
        ("error_{}_percent", ".2f"),
        ("error_{}_percent_printed", "g"),
        ("error_{}_percent_from_table_mm", "g"),
    )
    rows = [
        [f"{row['pressure_bar']:g}"]
        + [" / ".join(format(row[key.format(axis)], form) for axis in "yz") for key, form in keys]
        for row in report["rows"]
    ]
    return f"""## Table 1: constant curvature from the pressures alone

Two chambers under pressure. {parameters_text(report).split(" With gravity")[0]}
These four numbers come from the table's two computed columns, none from a measurement; from them
and the pressure follow the tip and the errors of the measured tip, relative to the computed one.
The last column is computed from the table's own millimetres and cut off after as many digits as
the table prints: it equals the printed one.

{markdown_table(heading, rows)}"""


def gravity() -> str:
    """Table 1 with gravity, every row predicted by the fit on the others."""
    report = table1_report(read_table())
    cells = table_cells(report)
    return f"""## Table 1 with gravity

A planar elastica that hangs, with two identified numbers: the arm's weight over its bending
stiffness, and a zero offset of the length. Each row is predicted by the fit on the other two;
positions as y / z in mm, errors relative to the computed value.

{markdown_table(cells[0], cells[1:])}

{parameters_text(report)}"""


def models() -> str:
    """Every model against the Cosserat rod."""
    results = compare(paper_arm(), table1_weight_over_bending_per_m3(), _SAMPLES)
    return f"""## Models side by side

{_SAMPLES} configurations over the workspace of the built-in arm `paper`, uniform in the lengths,
inside the limits. The reference is a Cosserat rod, extensible, with the weight over bending
stiffness of table 1. Errors are distances of the tips in percent of the arc length.

{errors_table(results)}

Without gravity the models are one and the same arc, and differ only in rounding, in a series cut
off (Godage) and in straight cables between plates (Jones and Walker with few units). With gravity
all of them miss the arm by much the same: no formula of the lengths alone can know its weight.

Where they fail: one chamber longer than the others by the length in the heading, at
100 straight lengths, without gravity. NaN, or the worst error in percent.

{failures_table(results)}

![Errors over the bend, and where gravity takes the tip]({_PICTURES}/{_MODELS_PICTURE})"""


#: The document, in its order.
SECTIONS: tuple[Section, ...] = (
    figures_kinematics.section,
    figures_workspace.section,
    table1,
    gravity,
    finite_elements.section,
    models,
)


def write_document(directory: Path, sections: tuple[Section, ...] = SECTIONS) -> Path:
    """Write the sections' document into ``directory``; return its path."""
    directory.mkdir(parents=True, exist_ok=True)
    path = directory / _DOCUMENT
    path.write_text("\n\n".join([_HEAD, *(section() for section in sections)]) + "\n")
    return path


def draw_pictures(directory: Path) -> None:
    """Draw the pictures of the workspaces and of the models into ``directory``."""
    directory.mkdir(parents=True, exist_ok=True)
    figures_workspace.draw(directory)
    draw(paper_arm(), table1_weight_over_bending_per_m3(), directory / _MODELS_PICTURE)


def main() -> None:
    """Write the document and its pictures, and say where."""
    parser = argparse.ArgumentParser(description="Write the validation's document.")
    parser.add_argument("--out", type=Path, default=Path("docs"), metavar="DIR")
    directory: Path = parser.parse_args().out
    draw_pictures(directory / _PICTURES)
    print(write_document(directory))


if __name__ == "__main__":
    main()

"""The workspace's part of docs/validation.md: volume, extents and pictures of the built-in arms."""

from functools import cache
from pathlib import Path

from pneuarm.controllers.workspace.summary import Summary, summarise
from pneuarm.service.configuration.configuration import load
from pneuarm.service.workspace.command import as_dict
from pneuarm.service.workspace.picture import write_png
from tools.validation.markdown import markdown_table

_SAMPLES = 20_000
_ARMS = ("paper", "table1", "trunk")


def _row(summary: Summary) -> list[str]:
    found = as_dict(summary)
    low, high = found["extents_mm"]
    return [
        summary.arm.name,
        "exact" if summary.exact else "searched",
        f"{found['volume_litres']:.6g} +- {found['volume_error_litres']:.1g}",
        *(f"{low[axis]:.1f} to {high[axis]:.1f}" for axis in range(3)),
    ]


@cache
def _summaries() -> list[Summary]:
    return [summarise(load(preset=name).build_arm(), _SAMPLES) for name in _ARMS]


def draw(directory: Path) -> None:
    """Draw the picture of each arm into a directory."""
    for summary in _summaries():
        write_png(directory / f"workspace-{summary.arm.name}.png", summary)


def section() -> str:
    """Return the text; its pictures lie in ``images/``."""
    table = markdown_table(
        ["arm", "how", "volume, litres", "x, mm", "y, mm", "z, mm"],
        [_row(summary) for summary in _summaries()],
    )
    return f"""## Workspace (the paper's section 4, Fig. 3)

The set of tip positions under Eq. (4), the bend limit and the pressure range; three lengths make
one arc, which is the geometric constraint between the chambers. For one section the set is known
exactly: membership by the exact inverse, the boundary as a watertight mesh. For several sections it
is searched, and the picture shows a convex outer hull.

{table}

![Workspace of the paper's arm from the side, with arms in it](images/workspace-paper.png)

The arm of table 1 has no vacuum: its pressure range ends its travel before Eq. (4) does.

![Workspace of the arm of table 1](images/workspace-table1.png)"""

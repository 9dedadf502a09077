"""The solved shapes with the arcs that the model fits to them, and the errors as bars.

``python -m tools.validation.finite_elements.pictures --out DIR`` reads the solutions that the run
left in DIR, and ``results.json``; it needs matplotlib.
"""

import argparse
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from pneuarm.controllers.kinematics.constant_curvature import section_inverse, section_transforms
from tools.validation.finite_elements import records
from tools.validation.finite_elements.design import (
    CASES,
    MESHES,
    PAPER_WORST_PERCENT,
    PRESSURES_BAR,
    TITLES,
    design_of,
)
from tools.validation.finite_elements.mesh import Mesh, build_mesh
from tools.validation.finite_elements.solution import read_displacements
from tools.validation.finite_elements.solver import JOB, case_directory

mpl.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.collections import PolyCollection

Array = NDArray[np.float64]

PICTURE = Path("docs/images/finite_elements.png")
#: What is smaller is drawn as this: the solver's own tolerance is of that order.
FLOOR_PERCENT = 1e-4

SHOWN = ("one", "two", "three", "one, caps only")
COLOURS = {"STIFF": "#5b6470", "WALL1": "#d1495b", "WALL2": "#3f88c5", "WALL3": "#edae49"}
_FACES = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def main() -> None:
    """Draw the picture."""
    parser = argparse.ArgumentParser(prog="python -m tools.validation.finite_elements.pictures")
    parser.add_argument("--out", type=Path, required=True, help="directory with the solutions")
    parser.add_argument("--picture", type=Path, default=PICTURE)
    options = parser.parse_args()
    figure = draw(options.out, records.load())
    options.picture.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(options.picture, dpi=110)
    print(options.picture)


def draw(out: Path, results: dict[str, Any]) -> Any:
    """Shapes at the highest pressure above, errors of every case and pressure below."""
    figure = plt.figure(figsize=(14, 8.6), layout="constrained")
    grid = figure.add_gridspec(2, len(SHOWN), height_ratios=[1.25, 1.0])
    for column, case in enumerate(SHOWN):
        mesh = build_mesh(design_of(case), MESHES["coarse"])
        pressures = CASES[case].pressures_bar
        data = case_directory(out, "coarse", case) / f"{JOB}.dat"
        moved = read_displacements(data, len(mesh.nodes), pressures)[-1]
        axes = figure.add_subplot(grid[0, column])
        _shape(axes, mesh, mesh.nodes + moved)
        axes.set_title(TITLES[case] + f", {pressures[-1]:g} bar", fontsize=11)
    _errors(figure.add_subplot(grid[1, :]), results)
    return figure


def _shape(axes: Any, mesh: Mesh, solved: Array) -> None:
    """Side view along y: rest in outline, the solution in colour, the arc to the solved tip."""
    faces, colours = _skin(mesh)
    depth = np.argsort(-solved[faces][:, :, 1].mean(axis=1))
    flat = [0, 2]
    rest = PolyCollection(
        list(mesh.nodes[faces][:, :, flat]), facecolor="none", edgecolor="#d5d8dc"
    )
    rest.set_linewidth(0.3)
    axes.add_collection(rest)
    axes.add_collection(
        PolyCollection(
            list(solved[faces[depth]][:, :, flat]),
            facecolor=[colours[face] for face in depth],
            edgecolor="#00000040",
            linewidth=0.25,
        )
    )
    tip = solved[mesh.rings[:, -1]].mean(axis=(0, 1))
    arc = section_transforms(np.linspace(0.0, 1.0, 60)[:, None] * section_inverse(tip))[:, :3, 3]
    axes.plot(arc[:, 0], arc[:, 2], color="black", lw=2.2, label="arc of the model")
    axes.plot(tip[0], tip[2], "o", color="black", ms=6, mfc="white", label="solved tip")
    axes.set(aspect="equal", xlim=(-125, 125), ylim=(-20, 235), xlabel="x, mm")
    if axes.get_subplotspec().is_first_col():
        axes.set_ylabel("z, mm")
        axes.legend(loc="upper right", fontsize=8)


def _skin(mesh: Mesh) -> tuple[NDArray[np.int64], list[str]]:
    """Faces that belong to one element only, by their corners, and the colour of each."""
    corners = np.concatenate([mesh.hexes[:, face] for face in _FACES])
    _, first, count = np.unique(
        np.sort(corners, axis=1), axis=0, return_index=True, return_counts=True
    )
    outside = first[count == 1]
    colour = np.empty(len(mesh.hexes), dtype=object)
    for part, elements in mesh.parts.items():
        colour[elements] = COLOURS[part]
    return corners[outside], [str(colour[index % len(mesh.hexes)]) for index in outside]


def _errors(axes: Any, results: dict[str, Any]) -> None:
    """Largest error over the three chambers, on a logarithmic axis, with the paper's beside it."""
    names = list(CASES)
    entries = sorted(results["cases"], key=lambda entry: names.index(entry["case"]))
    width = 0.8 / len(entries)
    at = np.arange(float(len(PRESSURES_BAR)))
    for number, entry in enumerate(entries):
        worst = [max(FLOOR_PERCENT, records.worst_error(row)) for row in entry["states"]]
        label = f"{TITLES[entry['case']]} ({entry['mesh']} mesh)"
        hatch = "//" if entry["mesh"] == "fine" else None
        place = at[: len(worst)] + (number + 0.5) * width - 0.4
        colour = f"C{names.index(entry['case'])}"
        axes.bar(place, worst, width, label=label, color=colour, hatch=hatch, edgecolor="white")
    axes.axhline(PAPER_WORST_PERCENT, color="black", ls="--", lw=1.2)
    axes.text(-0.45, 1.1 * PAPER_WORST_PERCENT, "the paper's worst, 1.6 %", fontsize=9)
    axes.set_xticks(at, [f"{pressure:g} bar" for pressure in PRESSURES_BAR])
    axes.set(yscale="log", ylim=(0.5 * FLOOR_PERCENT, 300.0), xlim=(-0.5, len(at) - 0.5))
    axes.set_ylabel("largest error of a chamber's length, %\n(1e-4: that or less)")
    axes.legend(fontsize=8, ncols=3, loc="upper right")


if __name__ == "__main__":
    main()

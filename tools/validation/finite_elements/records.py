"""The results as a small JSON file, one entry per mesh and case, updated case by case."""

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

from tools.validation.finite_elements.design import CASES, MESHES, RUNS, Design
from tools.validation.finite_elements.evaluation import Comparison
from tools.validation.finite_elements.mesh import Mesh

RESULTS = Path(__file__).with_name("results.json")

Record = dict[str, Any]


def load(path: Path = RESULTS) -> Record:
    """The recorded results."""
    found: Record = json.loads(path.read_text())
    return found


def record(
    path: Path,
    solver: str,
    mesh_name: str,
    mesh: Mesh,
    case: str,
    states: list[Comparison],
) -> None:
    """Put one case into the file; those of another design or solver are dropped."""
    head = {"solver": solver, "design": dataclasses.asdict(Design())}
    results = load(path) if path.exists() else {}
    if any(results.get(key) != value for key, value in head.items()):
        results = {**head, "meshes": {}, "cases": []}
    results["meshes"][mesh_name] = dataclasses.asdict(MESHES[mesh_name])
    kept = [entry for entry in results["cases"] if _key(entry) != (mesh_name, case)]
    entry = {
        "mesh": mesh_name,
        "case": case,
        "nodes": len(mesh.nodes),
        "elements": len(mesh.hexes),
        "states": _rows(CASES[case].pressures_bar, states),
    }
    results["cases"] = sorted([*kept, entry], key=lambda row: RUNS.index(_key(row)))
    path.write_text(_text(results))


def worst_error(row: Record) -> float:
    """Largest absolute error (percent) over the three chambers of one solved state."""
    return float(max(abs(error) for error in row["error_percent"]))


def states(results: Record, mesh: str, case: str) -> list[Record]:
    """The solved states of one case, by pressure; empty where it was not solved."""
    found = [row for row in results["cases"] if (row["mesh"], row["case"]) == (mesh, case)]
    return list(found[0]["states"]) if found else []


def finest(results: Record, case: str) -> str:
    """Name of the finest mesh on which the case was solved."""
    return "fine" if states(results, "fine", case) else "coarse"


def _key(entry: Record) -> tuple[str, str]:
    return entry["mesh"], entry["case"]


def _text(results: Record) -> str:
    """JSON with one line for every list of numbers."""
    text = json.dumps(results, indent=1)
    return re.sub(r"\[\s*([-\d.][^\[\]{}]*?)\s*\]", _one_line, text) + "\n"


def _one_line(found: re.Match[str]) -> str:
    return "[" + ", ".join(part.strip() for part in found.group(1).split(",")) + "]"


def _rows(pressures_bar: tuple[float, ...], states: list[Comparison]) -> list[Record]:
    return [
        {"pressure_bar": pressure, **{name: _rounded(value) for name, value in vars(state).items()}}
        for pressure, state in zip(pressures_bar, states, strict=True)
    ]


def _rounded(value: Any) -> Any:
    """Four decimals: 0.1 um, 1e-4 degrees, 1e-4 percent."""
    return round(value, 4) if isinstance(value, float) else [round(float(x), 4) for x in value]

"""Solve all cases and write the results: ``python -m tools.validation.finite_elements --out DIR``.

DIR keeps every solution: a second call solves only what is missing. The whole takes about an hour
on one core, ``--mesh coarse`` about ten minutes.
"""

import argparse
import sys
import time
from pathlib import Path

from tools.validation.finite_elements import records
from tools.validation.finite_elements.deck import write_deck
from tools.validation.finite_elements.design import CASES, MESHES, RUNS, design_of
from tools.validation.finite_elements.evaluation import compare
from tools.validation.finite_elements.mesh import build_mesh
from tools.validation.finite_elements.solution import SolverFailed, read_displacements
from tools.validation.finite_elements.solver import case_directory, solve, solver_version


def main() -> int:
    """Solve, print a line per case, record; 1 where the solver is missing or failed."""
    options = _parser().parse_args()
    try:
        version = solver_version()
        for number, (mesh_name, case) in enumerate(RUNS, start=1):
            if options.mesh in (mesh_name, "all"):
                print(f"[{number}/{len(RUNS)}] {mesh_name}, {case}: ", end="", flush=True)
                _solve_and_record(mesh_name, case, version, options.out, options.results)
    except SolverFailed as failure:
        print(failure, file=sys.stderr)
        return 1
    print(f"results in {options.results}")
    return 0


def _solve_and_record(mesh_name: str, case: str, version: str, out: Path, results: Path) -> None:
    started = time.monotonic()
    design = design_of(case)
    mesh = build_mesh(design, MESHES[mesh_name])
    data = solve(write_deck(design, mesh, CASES[case]), case_directory(out, mesh_name, case))
    fields = read_displacements(data, len(mesh.nodes), CASES[case].pressures_bar)
    states = [compare(design, mesh, field) for field in fields]
    records.record(results, version, mesh_name, mesh, case, states)
    worst = max(abs(error) for state in states for error in state.error_percent)
    seconds = time.monotonic() - started
    print(f"worst error {worst:.3f} % ({len(mesh.nodes)} nodes, {seconds:.0f} s)", flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tools.validation.finite_elements")
    parser.add_argument("--out", type=Path, required=True, help="directory for the solutions")
    parser.add_argument("--mesh", choices=[*MESHES, "all"], default="all")
    parser.add_argument("--results", type=Path, default=records.RESULTS, help="JSON to update")
    return parser


if __name__ == "__main__":
    sys.exit(main())

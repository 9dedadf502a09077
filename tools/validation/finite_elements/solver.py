"""Runs CalculiX on a deck, once: a directory that holds the same deck's solution is its cache."""

import hashlib
import os
import re
import shutil
import subprocess
from pathlib import Path

from tools.validation.finite_elements.solution import SolverFailed

JOB = "job"


def find_solver() -> str:
    """Path of ``ccx``; raises SolverFailed where it is not installed."""
    path = shutil.which("ccx")
    if path is None:
        raise SolverFailed(
            "ccx, the CalculiX solver, is not on the PATH: on Debian and Ubuntu install it with "
            "'apt-get install calculix-ccx'"
        )
    return path


def solver_version() -> str:
    """Name and version of the solver, as it reports them."""
    printed = subprocess.run([find_solver(), "-v"], capture_output=True, text=True, check=False)
    found = re.search(r"Version (\S+)", printed.stdout)
    return f"CalculiX {found.group(1) if found else 'of unknown version'}"


def case_directory(out: Path, mesh_name: str, case: str) -> Path:
    """Where the solution of a case is kept."""
    return out / f"{mesh_name}-{case.replace(', ', '-').replace(' ', '-')}"


def solve(deck: str, directory: Path) -> Path:
    """Solve a deck in ``directory`` and return its ``.dat`` file; raises SolverFailed.

    The mark that a run is complete is written last and names the deck: a run that was interrupted,
    or a deck that has changed since, is solved anew.
    """
    data, mark = directory / f"{JOB}.dat", directory / "complete"
    digest = hashlib.sha256(deck.encode()).hexdigest()
    if data.exists() and mark.exists() and mark.read_text() == digest:
        return data
    directory.mkdir(parents=True, exist_ok=True)
    mark.unlink(missing_ok=True)
    (directory / f"{JOB}.inp").write_text(deck)
    _run(find_solver(), directory)
    mark.write_text(digest)
    return data


def _run(solver: str, directory: Path) -> None:
    """One thread: the run shares its machine."""
    log = directory / "ccx.log"
    with log.open("w") as output:
        process = subprocess.run(
            [solver, JOB],
            cwd=directory,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            stdout=output,
            stderr=subprocess.STDOUT,
            check=False,
        )
    if process.returncode != 0 or "Job finished" not in log.read_text():
        raise SolverFailed(f"ccx did not finish in {directory}: the reason is in {log}")

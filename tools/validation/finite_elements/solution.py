"""Displacements out of CalculiX's ``.dat`` file, one field for every pressure."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pneuarm.controllers.arm.errors import PneuarmError

Array = NDArray[np.float64]

_HEADER = re.compile(r"displacements .* and time\s+(\S+)")


class SolverFailed(PneuarmError):
    """The finite-element solver is missing, stopped early or left a file that cannot be read."""


def read_displacements(path: Path, n_nodes: int, pressures_bar: tuple[float, ...]) -> list[Array]:
    """Displacements ``(n_nodes, 3)`` in mm at every pressure, which is the solver's time.

    Raises SolverFailed where a pressure or a node is missing.
    """
    fields = {}
    blocks = re.split(r"(?= displacements )", path.read_text())
    for block in blocks:
        header = _HEADER.search(block)
        if header is not None:
            fields[float(header.group(1))] = _field(block)
    for pressure in pressures_bar:
        if fields.get(pressure, np.empty(0)).shape != (n_nodes, 3):
            raise SolverFailed(
                f"{path}: no displacements of all {n_nodes} nodes at {pressure:g} bar"
            )
    return [fields[pressure] for pressure in pressures_bar]


def _field(block: str) -> Array:
    rows = [line.split() for line in block.splitlines()[1:] if line.strip()]
    table = np.array(rows, dtype=np.float64)
    return np.asarray(table[np.argsort(table[:, 0]), 1:])

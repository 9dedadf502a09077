"""The point of one section's boundary that is best in some sense: nearest, or furthest out.

For a body with mirror planes the nearest point lies on the target's own side of each of them, for
what lies across is nearer in the mirror; so the target is folded into the wedge and only three
smooth sheets remain. A grid on them finds every local minimum wider than a cell, and a compass
search follows the best of these down, all at once, inside the sheets' edges.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.workspace.region import (
    WEDGE_RAD,
    SectionRegion,
    Sheet,
    Sheets,
    folded,
    unfolded,
)

#: Cost of points ``(..., 3)``, shape ``(...)``.
Cost = Callable[[Array], Array]

_CELLS = 24
_FOLLOWED = 4  # local minima of a sheet
_SMALLEST_STEP = 1e-8  # of a sheet: nanometres
_ROUNDS = 200
_POLISHED = 2
_SIMPLEX = np.array([[0.01, 0.003], [0.003, -0.01]])
_COMPASS = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)], float)


@dataclass(frozen=True)
class BoundaryPoint:
    """A point ``(3,)`` of the boundary in the wedge, and the cost there."""

    position_m: Array
    cost: float


class BoundarySearch:
    """Searches the boundary of one region; the grid is computed once."""

    def __init__(self, region: SectionRegion) -> None:
        self._region = region
        nodes = np.linspace(0.0, 1.0, _CELLS + 1)
        sheet = np.repeat(np.arange(len(Sheet)), len(nodes) ** 2)
        across, along = np.meshgrid(nodes, nodes, indexing="ij")
        self._sheet: Sheets = sheet.reshape(len(Sheet), len(nodes), len(nodes))
        self._place = np.broadcast_to(
            np.stack([across, along], axis=-1), (*self._sheet.shape, 2)
        ).reshape(-1, 2)
        self._points = self._at(self._sheet, across, along)

    def _at(self, sheet: Sheets, across: Array, along: Array) -> Array:
        return self._region.points(sheet, WEDGE_RAD * across, along)

    def best(self, cost: Cost) -> BoundaryPoint:
        """Return the point of the boundary in the wedge with the least cost."""
        values = cost(self._points)
        minima = np.where(_is_local_minimum(values), values, np.inf).reshape(len(Sheet), -1)
        # From every sheet: a sheet that is a mere line has many equal minima, and would crowd out.
        best = np.argsort(minima, axis=1, kind="stable")[:, :_FOLLOWED]
        chosen = (best + minima.shape[1] * np.arange(len(Sheet))[:, None]).reshape(-1)
        chosen = chosen[np.isfinite(minima.reshape(-1)[chosen])]
        sheet = self._sheet.flat[chosen]
        place, value = self._descend(cost, sheet, self._place[chosen])
        polished = [
            self._polish(cost, sheet[index], place[index])
            for index in np.argsort(value)[:_POLISHED]
        ]
        return min(polished, key=lambda point: point.cost)

    def _polish(self, cost: Cost, sheet: Sheets, place: Array) -> BoundaryPoint:
        """Follow a long narrow valley that lies across the compass to its bottom."""

        def at(place: Array) -> Array:
            return self._at(sheet, *place)

        corners = np.clip(place + _SIMPLEX, 0.0, 1.0)
        corners = np.where(corners == place, np.clip(place - _SIMPLEX, 0.0, 1.0), corners)
        options = {
            "initial_simplex": np.vstack([place, corners]),
            "xatol": _SMALLEST_STEP,
            "fatol": 0.0,
            "maxfev": _ROUNDS,
        }
        found = minimize(
            lambda place: float(cost(at(place))),
            place,
            method="Nelder-Mead",
            bounds=((0.0, 1.0), (0.0, 1.0)),
            options=options,
        )
        return BoundaryPoint(at(found.x), float(found.fun))

    def _descend(self, cost: Cost, sheet: Sheets, place: Array) -> tuple[Array, Array]:
        """Compass search from places ``(n, 2)``: to the best of 8 neighbours, or half the step."""
        value = cost(self._at(sheet, place[:, 0], place[:, 1]))
        step, rows = np.full(len(place), 0.5 / _CELLS), np.arange(len(place))
        for _ in range(_ROUNDS):
            tried = np.clip(place[:, None] + step[:, None, None] * _COMPASS, 0.0, 1.0)
            costs = cost(self._at(sheet[:, None], tried[..., 0], tried[..., 1]))
            least = np.argmin(costs, axis=1)
            better = costs[rows, least] < value
            place = np.where(better[:, None], tried[rows, least], place)
            value = np.where(better, costs[rows, least], value)
            step = np.where(better, step, 0.5 * step)
            if (step < _SMALLEST_STEP).all():
                break
        return place, value

    def nearest_m(self, position_m: Array) -> Array:
        """Return the point (3,) of the whole boundary nearest to ``position_m`` (3,)."""
        target, turn, side = folded(position_m)

        def distance(points: Array) -> Array:
            offset = points - target
            squared: Array = np.einsum("...i,...i->...", offset, offset)
            return squared

        return unfolded(self.best(distance).position_m, turn, side)

    def furthest_m(self, direction: Array) -> Array:
        """Return the point (3,) of the whole boundary furthest out along ``direction`` (3,)."""
        wanted, turn, side = folded(direction)
        return unfolded(self.best(lambda points: -(points @ wanted)).position_m, turn, side)


def _is_local_minimum(values: Array) -> NDArray[np.bool_]:
    """Nodes of ``(sheets, n, n)`` that no neighbour on the same sheet undercuts."""
    padded = np.pad(values, ((0, 0), (1, 1), (1, 1)), constant_values=np.inf)
    n = values.shape[1]
    lowest = np.ones(values.shape, dtype=bool)
    for i, j in (_COMPASS + 1).astype(int):
        lowest &= values <= padded[:, i : i + n, j : j + n]
    return lowest

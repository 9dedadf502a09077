"""Table 1 with gravity: a hanging elastica with two identified numbers, tested on a row apart.

A rod in a plane, clamped at the top with its straight axis downward, bent by a moment constant
along it, as pressure does it, and straightened by its own weight. With the share ``s`` of the
length and the angle ``psi`` from the vertical the moments about every point give

    psi'' = (W L^2 / EI) (1 - s) sin(psi),   psi(0) = 0,   psi'(1) = theta

(the elastica of Euler, 1744, with natural curvature and distributed weight). ``theta`` and ``L``
come from the pressure as identified in :mod:`pneuarm.service.validation.table1`; what is fitted to
the measured positions is ``W/EI`` (1/m^2, W the arm's whole weight) and a zero offset of the
length, which the paper names among its errors. Without weight the curve is the constant-curvature
arc.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_bvp
from scipy.optimize import least_squares

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import section_inverse
from pneuarm.service.validation.table1 import BAR, MM, IdentifiedArm, PrintedTable, identify

_NODES = 21
_TOLERANCE = 1e-10
#: Where the fit starts, and the sizes that count as one: 1/m^2 and m.
_START = (20.0, 0.0)
_SCALE = (10.0, 1e-3)


@dataclass(frozen=True)
class GravityFit:
    """The two identified numbers."""

    weight_over_bending_per_m2: float
    length_zero_m: float


def hanging_tip(length_m: float, theta_rad: float, weight_over_bending_per_m2: float) -> Array:
    """Tip (2,), sideways and down, m, of the hanging elastica.

    Raises InvalidInput for a length that is not above zero, an angle of a full turn or more, a
    weight that is not finite, and where no solution is found.
    """
    _check(length_m, theta_rad, weight_over_bending_per_m2)
    load = weight_over_bending_per_m2 * length_m**2

    def slopes(s: Array, state: Array) -> Array:
        psi, bend = state[0], state[1]
        return np.stack([bend, load * (1.0 - s) * np.sin(psi), np.sin(psi), np.cos(psi)])

    def ends(top: Array, tip: Array) -> Array:
        return np.array([top[0], tip[1] - theta_rad, top[2], top[3]])

    nodes = np.linspace(0.0, 1.0, _NODES)
    guess = np.stack([theta_rad * nodes, theta_rad + 0.0 * nodes, 0.0 * nodes, nodes])
    solution = solve_bvp(slopes, ends, nodes, guess, tol=_TOLERANCE, max_nodes=5000)
    if not solution.success:
        raise InvalidInput(
            f"weight_over_bending_per_m2 = {weight_over_bending_per_m2:g}, theta_rad = "
            f"{theta_rad:g}: no equilibrium was found; allowed is what a hanging arm bears"
        )
    return np.asarray(length_m * solution.y[2:, -1], dtype=np.float64)


def _check(length_m: float, theta_rad: float, weight: float) -> None:
    if not 0.0 < length_m < np.inf:
        raise InvalidInput(f"length_m = {length_m:g}: it must be above 0 and finite")
    if not abs(theta_rad) < 2.0 * np.pi:
        raise InvalidInput(f"theta_rad = {theta_rad:g}: it must be less than a full turn")
    if not np.isfinite(weight):
        raise InvalidInput(f"weight_over_bending_per_m2 = {weight:g}: it must be finite")


def predict(fit: GravityFit, arm: IdentifiedArm, pressures_pa: Array) -> Array:
    """Tips (n, 2) with gravity, m, for pressures (n,) in the two driven chambers."""
    flat = arm.tip_m(pressures_pa)
    arcs = section_inverse(np.stack([flat[:, 0], 0.0 * flat[:, 0], flat[:, 1]], axis=-1))
    return np.array(
        [
            hanging_tip(length + fit.length_zero_m, theta, fit.weight_over_bending_per_m2)
            for length, theta, _ in arcs
        ]
    )


def fit_rows(table: PrintedTable, arm: IdentifiedArm, rows: list[int]) -> GravityFit:
    """Fit the two numbers to the measured positions of ``rows``, least squares in millimetres.

    Raises InvalidInput for no rows or one that the table does not have.
    """
    count = len(table.printed["pressure_bar"])
    if not rows or not all(0 <= row < count for row in rows):
        raise InvalidInput(f"rows = {rows}: allowed are one or more of 0 to {count - 1}")
    pressures = table.column("pressure_bar", BAR)[rows]
    measured = measured_m(table)[rows]

    def residual(numbers: Array) -> Array:
        trial = GravityFit(float(numbers[0]), float(numbers[1]))
        return (predict(trial, arm, pressures) - measured).reshape(-1) / MM

    weight, zero = least_squares(residual, _START, x_scale=_SCALE).x
    return GravityFit(float(weight), float(zero))


def measured_m(table: PrintedTable) -> Array:
    """Measured tips (n, 2), m."""
    return np.stack([table.column("y_measured_mm", MM), table.column("z_measured_mm", MM)], -1)


@dataclass(frozen=True)
class CrossValidation:
    """For each row in turn: the fit on the others and what it predicts for it, (n, 2), m."""

    fits: tuple[GravityFit, ...]
    predicted_m: Array
    all_rows: GravityFit

    def errors_percent(self, table: PrintedTable) -> Array:
        """Deviation (n, 2) of the measured from the predicted, percent of the predicted."""
        return np.asarray(100.0 * (measured_m(table) / self.predicted_m - 1.0))


def cross_validate(table: PrintedTable) -> CrossValidation:
    """Fit on all rows but one and predict that one, in turn."""
    arm = identify(table)
    pressures = table.column("pressure_bar", BAR)
    everyone = list(range(len(pressures)))
    fits, tips = [], []
    for test in everyone:
        fits.append(fit_rows(table, arm, [row for row in everyone if row != test]))
        tips.append(predict(fits[-1], arm, pressures[[test]])[0])
    return CrossValidation(tuple(fits), np.array(tips), fit_rows(table, arm, everyone))

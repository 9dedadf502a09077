"""Chamber pressure <-> chamber length, through the calibrated map of each section.

The lengths q are those of the arm as it really hangs. The unloaded lengthening of the three
chambers of a section is both

    K (a p + b p |p|)            p gauge pressures, K the coupling, a lengthening, b softening
    q + c dV/dq - rest           V the potential energy of the weight, c the compliances

so that pressures follow explicitly from lengths, and lengths from pressures by a few Newton steps.
The compliances act on the arc length and on the bending vector ``(u, v)`` of a section; V couples
the sections, see :mod:`pneuarm.controllers.kinematics.gravity`. Not calibrated, K is the identity
and the compliances are zero: then a chamber's lengthening is ``a p + b p |p|``, odd in p, so that
one map serves chambers that lengthen under pressure and shorten under vacuum. With ``b > 0`` a
chamber gets softer as it fills, as table 1 of the paper shows.
"""

from itertools import product

import casadi as ca
import numpy as np

from pneuarm.controllers.actuation.symbols import is_plain, symbolic_lengthening, symbolic_unloaded
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.geometry.compiled_function import CompiledFunction

#: A Newton step below this (m) is the last, which leaves an error of some 1e-13 m; one that needs
#: more steps than this does not converge.
_CONVERGED_M = 1e-7
_NEWTON_STEPS = 12


def symbolic_pressures(arm: Arm, lengths: ca.SX) -> ca.SX:
    """Gauge pressures (n_chambers,), Pa, that give the lengths (n_chambers,), m, in C order."""
    unloaded = symbolic_unloaded(arm, lengths)
    pressures = []
    for index, section in enumerate(arm.sections):
        lengthening = unloaded[3 * index : 3 * index + 3] - section.rest_length_m
        own = ca.DM(np.linalg.inv(section.coupling)) @ lengthening
        a, b = section.lengthening_m_per_pa, section.softening_m_per_pa2
        pressures.append(2.0 * own / (a + ca.sqrt(a**2 + 4.0 * b * ca.fabs(own))))
    return ca.vertcat(*pressures)


class PressureMap:
    """The map of a whole arm; arrays of shape ``(n_sections, 3)``, or a batch ``(..., n, 3)``."""

    def __init__(self, arm: Arm) -> None:
        self._shape = (arm.n_sections, 3)
        self._rest_m = arm.rest_lengths_m
        self._linear = arm.per_chamber("lengthening_m_per_pa")
        self._quadratic = arm.per_chamber("softening_m_per_pa2")
        #: Whether the last :meth:`lengths_m` found the loaded lengths.
        self.converged = True
        self._plain = is_plain(arm)
        if not self._plain:
            self._compile(arm)

    def _compile(self, arm: Arm) -> None:
        lengths = ca.SX.sym("lengths", arm.n_chambers)
        pressures = ca.SX.sym("pressures", arm.n_chambers)
        goal = ca.SX.sym("goal", arm.n_chambers)
        residual = symbolic_unloaded(arm, lengths) - goal
        step = ca.solve(ca.jacobian(residual, lengths), residual)
        self._pressures = CompiledFunction(
            "pressures", [lengths], [symbolic_pressures(arm, lengths)]
        )
        unloaded = symbolic_lengthening(arm, pressures) + arm.rest_lengths_m.reshape(-1)
        self._unloaded = CompiledFunction("unloaded", [pressures], [unloaded])
        self._newton = CompiledFunction("newton", [lengths, goal], [step])

    def lengths_m(self, pressures_pa: Array, near_m: Array | None = None) -> Array:
        """Lengths of the hanging chambers at the given gauge pressures.

        ``near_m`` is where Newton's method starts, for one configuration; the unloaded lengths
        where it is not given. Where it does not converge the result is the unloaded lengths, and
        ``converged`` is False.
        """
        if self._plain:
            curve = self._linear + self._quadratic * np.abs(pressures_pa)
            return self._rest_m + pressures_pa * curve
        if pressures_pa.shape == self._shape:
            return self._loaded_m(pressures_pa, near_m)
        flat = pressures_pa.reshape(-1, *self._shape)
        loaded = [self._loaded_m(each, None) for each in flat]
        return np.array(loaded).reshape(pressures_pa.shape)

    def _loaded_m(self, pressures_pa: Array, near_m: Array | None) -> Array:
        goal = self._unloaded(pressures_pa)[0]
        lengths = (goal if near_m is None else near_m.reshape(-1)).copy()
        for _ in range(_NEWTON_STEPS):
            step = self._newton(lengths, goal)[0]
            lengths -= step
            if max(map(abs, step.tolist())) < _CONVERGED_M:
                self.converged = True
                return lengths.reshape(self._shape)
        self.converged = False
        return goal.reshape(self._shape).copy()

    def pressures_pa(self, lengths_m: Array) -> Array:
        """Gauge pressures that give the lengths; the exact inverse of :meth:`lengths_m`."""
        if self._plain:
            lengthening = lengths_m - self._rest_m
            root = np.sqrt(self._linear**2 + 4.0 * self._quadratic * np.abs(lengthening))
            return 2.0 * lengthening / (self._linear + root)
        if lengths_m.shape == self._shape:
            return self._pressures(lengths_m)[0].reshape(self._shape).copy()
        columns = self._pressures.columns(lengths_m.reshape(-1, self._rest_m.size).T)
        return columns.T.reshape(lengths_m.shape)


def pressure_length_bounds_m(arm: Arm) -> tuple[Array, Array]:
    """Lengths at the pressure limits, lower and upper, each ``(n_sections, 3)``.

    With coupling and load the pressure range is no box in the lengths: these are then the smallest
    and largest lengths over its corners, the same corner in every section. The exact limit is the
    one on :func:`symbolic_pressures`.
    """
    pressure_map = PressureMap(arm)
    low, high = arm.per_chamber("pressure_min_pa"), arm.per_chamber("pressure_max_pa")
    corners = np.array(list(product((0.0, 1.0), repeat=3)))[:, None, :]
    lengths = pressure_map.lengths_m(np.where(corners > 0.0, high, low))
    return lengths.min(axis=0), lengths.max(axis=0)


def length_bounds_m(arm: Arm) -> tuple[Array, Array]:
    """Lengths that may be commanded: inside Eq. (4) and inside the pressure range.

    Returns the lower and the upper bound, each ``(n_sections, 3)``, strictly inside the open
    interval of Eq. (4) by LENGTH_MARGIN_M.
    """
    pressure_low, pressure_high = pressure_length_bounds_m(arm)
    shortest, longest = arm.length_interval_m
    return np.maximum(shortest, pressure_low), np.minimum(longest, pressure_high)

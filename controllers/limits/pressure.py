"""Pressures inside their range, and how fast they may change, through the map of the actuation."""

import casadi as ca
import numpy as np

from pneuarm.controllers.actuation.pressure_map import symbolic_pressures
from pneuarm.controllers.arm.arm import Arm


class PressureLimit:
    """Keeps the pressure of every chamber within its range; counted in metres of the chamber."""

    margin_m = 1e-7

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        self._low = ca.DM(arm.per_chamber("pressure_min_pa").reshape(-1))
        self._high = ca.DM(arm.per_chamber("pressure_max_pa").reshape(-1))
        self._slew = ca.DM(arm.per_chamber("pressure_slew_max_pa_s").reshape(-1))
        #: Metres a pascal near zero pressure.
        self._metres = ca.DM(arm.per_chamber("lengthening_m_per_pa").reshape(-1))

    def slack(self, lengths: ca.SX) -> ca.SX:
        """Distances to the lower bounds, then to the upper ones."""
        pressures = symbolic_pressures(self._arm, lengths)
        return ca.vertcat(
            self._metres * (pressures - self._low), self._metres * (self._high - pressures)
        )

    def slew_share(self, lengths: ca.SX, rates: ca.SX) -> ca.SX:
        """Largest share of its slew limit that a chamber uses up at ``rates``, to first order."""
        jacobian = ca.jacobian(symbolic_pressures(self._arm, lengths), lengths)
        return ca.norm_inf((jacobian @ rates) / self._slew)

    def slew_slack(self, before: ca.SX, after: ca.SX, dt: ca.SX) -> ca.SX:
        """What a step leaves of the slew limit (n_chambers,), in metres, exactly."""
        change = symbolic_pressures(self._arm, after) - symbolic_pressures(self._arm, before)
        return self._metres * (self._slew * dt - ca.fabs(change))

    def is_diagonal(self) -> bool:
        """Whether every pressure depends on its own chamber alone."""
        lengths = ca.SX.sym("lengths", self._arm.n_chambers)
        jacobian = ca.jacobian(symbolic_pressures(self._arm, lengths), lengths)
        rows, columns = np.array(jacobian.sparsity().get_triplet())
        return bool((rows == columns).all())

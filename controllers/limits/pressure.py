"""Pressures inside their range, and how fast they may change, through the map of the actuation.

They may change as fast as the slew limit says, and no faster than the valves can follow: a tip that
is commanded somewhere else than where the air can bring it comes to another place in the end, for
the chambers remember their way.
"""

import casadi as ca
import numpy as np

from pneuarm.controllers.actuation.pressure_map import symbolic_pressures
from pneuarm.controllers.actuation.valve_lead import largest_rates_pa_s
from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.limits.limit import Limit, column

#: Of the slew limit, that a step to first order may use; the exact check follows.
_SLEW_SHARE = 0.998


class PressureLimit(Limit):
    """Keeps the pressure of every chamber within its range; counted in metres of the chamber."""

    name, bit = "pressure", 4
    margin_m = 1e-7
    two_sided = in_workspace = True

    def __init__(self, arm: Arm) -> None:
        super().__init__(arm)
        self._low = column(arm.per_chamber("pressure_min_pa"))
        self._high = column(arm.per_chamber("pressure_max_pa"))
        slew = arm.per_chamber("pressure_slew_max_pa_s")
        rising, falling = largest_rates_pa_s(arm.response)
        self._rising = column(np.minimum(slew, rising))
        self._falling = column(np.minimum(slew, falling))
        #: Metres a pascal near zero pressure.
        self._metres = column(arm.per_chamber("lengthening_m_per_pa"))

    def slack(self, lengths: ca.SX) -> ca.SX:
        """Distances to the lower bounds, then to the upper ones."""
        pressures = symbolic_pressures(self._arm, lengths)
        return ca.vertcat(
            self._metres * (pressures - self._low), self._metres * (self._high - pressures)
        )

    def approach(self, slack: ca.SX, share: ca.SX) -> ca.SX:
        """As every limit, but a margin that is lacking is taken back at once.

        A vented chamber has none of it: without this the arm could but creep along the bound.
        """
        lacking = ca.fmax(slack - self.margin_m, -self.margin_m)
        return ca.fmin(lacking, super().approach(slack, share))

    def rate_share(self, lengths: ca.SX, rates: ca.SX) -> ca.SX:
        """Largest share of its slew limit that a chamber uses up, to first order."""
        jacobian = ca.jacobian(symbolic_pressures(self._arm, lengths), lengths)
        change = jacobian @ rates
        return ca.mmax(ca.fmax(change / self._rising, -change / self._falling)) / _SLEW_SHARE

    def step_slack(self, before: ca.SX, after: ca.SX, dt: ca.SX) -> ca.SX:
        """What a step leaves of the slew limit (n_chambers,), in metres, exactly."""
        change = symbolic_pressures(self._arm, after) - symbolic_pressures(self._arm, before)
        return self._metres * ca.fmin(self._rising * dt - change, self._falling * dt + change)

    def contradiction(self) -> str:
        """Nothing: zero is in the range of every section, and a loaded arm hangs at zero."""
        return ""

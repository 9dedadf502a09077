"""What is sent to valves that lag, so that the chambers get the pressures that are wanted.

A first-order lag is undone by ``p + lag dp/dt``. The derivative is smoothed over a short time,
which is the lag that remains. It works behind the inverse of the chambers' hysteresis: the pressure
in the chamber turns where the wanted one turns, not where the lead before it does.
"""

import math

import numpy as np

from pneuarm.controllers.arm.arm import Array

#: The lag that remains (s), never more than the valves have.
REMAINING_S = 0.01


class ValveLead:
    """Pressures (n_sections, 3) in, pressures to send out, once a tick."""

    def __init__(self, lag_s: float) -> None:
        self.remaining_s = min(REMAINING_S, lag_s)
        self._lead_s = lag_s - self.remaining_s
        self._last: Array | None = None
        self._rate = np.zeros(())

    def forget(self) -> None:
        """The next pressures are the first ones."""
        self._last = None

    def sent_pa(self, wanted_pa: Array, dt_s: float, lead: float = 1.0) -> Array:
        """Pressures ahead of the wanted ones by the lag, or by the share ``lead`` of it.

        Pressures that are no finite numbers are returned as they are, and forgotten: they are the
        guard's affair, and no derivative must remember them.
        """
        if not math.isfinite(float(wanted_pa.sum())):
            self.forget()
            return wanted_pa
        if self._last is None or dt_s <= 0.0:
            self._last, self._rate = wanted_pa, np.zeros_like(wanted_pa)
            return wanted_pa
        share = 1.0 / (self.remaining_s + dt_s)
        self._rate = self._rate + share * (wanted_pa - self._last - dt_s * self._rate)
        self._last = wanted_pa
        return wanted_pa + lead * self._lead_s * self._rate

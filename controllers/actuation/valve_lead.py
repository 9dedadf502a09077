"""What is sent to valves that lag, so that the chambers get the pressures that are wanted.

A first-order lag of filling or exhausting is exchanged for a short one, the same for both: the
pressure that the chamber shall have is the wanted one behind that short lag, and

    sent = p + lag dp/dt,    filling where p rises, else exhausting

makes it so. It works behind the inverse of the chambers' hysteresis: the pressure in the chamber
turns where the wanted one turns, not where the lead before it does.
"""

import math
from dataclasses import replace

import numpy as np

from pneuarm.controllers.arm.arm import Array, Response

#: The lag that remains (s), never more than the valves have; and, where they are slow, a share of
#: their slower lag: a lead of more than so many times what remains is mostly noise.
REMAINING_S, REMAINING_SHARE = 0.01, 1.0 / 8.0

#: Valves with no larger lag (s) follow whatever the slew limit allows.
_QUICK_S = 0.08


def largest_rates_pa_s(response: Response) -> tuple[float, float]:
    """Rates of rise and of fall that ask for no larger lead than there may be.

    Near a bound of the range there is no room for a lead, and an orifice lets less through, the
    less pressure there is before it: a lag stands for all of that only where little is asked.
    """
    rising, falling = (
        response.lead_max_pa / max(lag_s - _QUICK_S, 1e-9)
        for lag_s in (response.filling_lag_s, response.exhausting_lag_s)
    )
    return rising, falling


class ValveLead:
    """Pressures (n_sections, 3) in, pressures to send out, once a tick.

    ``behind`` is the response of the arm as it is seen through the lead.
    """

    def __init__(self, response: Response) -> None:
        slower_s = response.slower_lag_s
        remaining_s = min(max(REMAINING_S, REMAINING_SHARE * slower_s), slower_s)
        self.behind = replace(response, filling_lag_s=remaining_s, exhausting_lag_s=remaining_s)
        self._filling_s = response.filling_lag_s - remaining_s
        self._exhausting_s = response.exhausting_lag_s - remaining_s
        self._remaining_s = remaining_s
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
        share = 1.0 / (self._remaining_s + dt_s)
        self._rate = self._rate + share * (wanted_pa - self._last - dt_s * self._rate)
        self._last = wanted_pa
        ahead_s = np.where(self._rate > 0.0, self._filling_s, self._exhausting_s)
        return wanted_pa + lead * ahead_s * self._rate

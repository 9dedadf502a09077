"""What the pressures must do so that chambers with hysteresis do what the map says.

A chamber answers to its pressure like a play of half width w (`hysteresis_pa`): what acts is the
pressure less ``w side``, with ``side`` -1 to 1 for the side on which the play is engaged. Here the
side follows the pressure that shall act: it crosses over within a small way, so that nothing jumps
where the direction turns.
"""

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array

#: Way of the acting pressure, in half widths, in which the play goes from slack to engaged.
CROSSING = 0.1


class InversePlay:
    """Remembers the side of every chamber's play, and leads the pressures across it.

    Calling it again with the same pressures changes nothing.
    """

    def __init__(self, arm: Arm) -> None:
        self._width_pa = arm.per_chamber("hysteresis_pa")
        self._crossing_pa = np.maximum(CROSSING * self._width_pa, 1e-9)
        self._side = np.zeros_like(self._width_pa)
        #: Share of the play that is led across: less where feedback does the rest, and must not
        #: be kicked by a width that is a little too large.
        self.share = 1.0
        self._acting_pa = np.zeros_like(self._width_pa)
        self.none = not self._width_pa.any()

    def start_from(self, sent_pa: Array) -> Array:
        """Take note of pressures that were reached without it; return those that act then."""
        width_pa = self.share * self._width_pa
        low, high = sent_pa - width_pa, sent_pa + width_pa
        self._acting_pa = np.minimum(np.maximum(self._acting_pa, low), high)
        self._side = (sent_pa - self._acting_pa) / np.maximum(width_pa, 1e-9)
        return self._acting_pa

    def sent_pa(self, acting_pa: Array, to_slack: bool = False) -> Array:
        """Pressures to send (n_sections, 3) so that ``acting_pa`` act.

        ``to_slack`` leads the play to its middle instead, where pressures are sent as they are.
        """
        moved = (acting_pa - self._acting_pa) / self._crossing_pa
        self._acting_pa = acting_pa
        if to_slack:
            left = np.maximum(np.abs(self._side) - np.abs(moved), 0.0)
            self._side = np.copysign(left, self._side)
        else:
            self._side = np.minimum(np.maximum(self._side + moved, -1.0), 1.0)
        return acting_pa + self.share * self._width_pa * self._side

"""Whether the setpoints that a device shows are any that were sent to it."""

from collections import deque

import numpy as np

from pneuarm.controllers.arm.arm import Array

#: A device may be this many writes behind.
_REMEMBERED_WRITES = 64
#: So many foreign ones in a row, and it is no line that was lost on the way.
_MOST_FOREIGN = 12


class SentSetpoints:
    """The last setpoints sent, (n_sections, 3) each, and those in a row that were not."""

    def __init__(self, tolerance_pa: float) -> None:
        self._tolerance_pa = tolerance_pa
        self.begin(np.zeros(0))

    def begin(self, pressures_pa: Array) -> None:
        """Forget all but these."""
        self._sent = deque([pressures_pa.copy()], maxlen=_REMEMBERED_WRITES)
        self._foreign = 0

    def add(self, pressures_pa: Array) -> None:
        """Remember what is being sent."""
        self._sent.append(pressures_pa.copy())

    def are_foreign(self, shown_pa: Array) -> bool:
        """Whether the device has now shown foreign setpoints for too long."""
        shown = np.abs(np.array(self._sent) - shown_pa) <= self._tolerance_pa
        self._foreign = 0 if shown.all(axis=(1, 2)).any() else self._foreign + 1
        return self._foreign > _MOST_FOREIGN

"""A device with the guard right before it: nothing reaches the device but through here."""

from typing import Protocol

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.hardware.guard import Guard, Guarded
from pneuarm.hardware.interface import Hardware, Measurement

#: A device that takes whole steps of its own (1 mbar) is believed to have taken the whole: the
#: fraction is not lost to the next slew, which at a slow slew would never get over a step.
STEP_PA = 150.0


class GuardedHardware(Protocol):
    """A device that no command reaches unguarded, wherever its guard runs."""

    def connect(self) -> None:
        """Open the device; every output is zero afterwards."""
        ...

    def read(self, time_s: float) -> Measurement:
        """Return the newest measurement; raises HardwareError."""
        ...

    def write(self, pressures_pa: Array, commanded_at_s: float, now_s: float) -> Guarded:
        """Set what the guard allows of a command; return that and what it had to change."""
        ...

    def vent(self, time_s: float) -> None:
        """Set every output to zero, past the guard."""
        ...

    def close(self) -> None:
        """Let the device go. Safe to call twice."""
        ...

    @property
    def sent_pa(self) -> Array:
        """What the device last acknowledged, (n_sections, 3)."""
        ...


class GuardedDevice:
    """A device in this process behind its guard; satisfies :class:`GuardedHardware`."""

    def __init__(self, hardware: Hardware, guard: Guard, n_sections: int) -> None:
        self._hardware, self._guard = hardware, guard
        self._zeros = np.zeros((n_sections, 3))
        self._zeros.setflags(write=False)
        self._sent: Array = self._zeros
        self._allowed: Array = self._zeros

    @property
    def sent_pa(self) -> Array:
        """What the device last acknowledged, (n_sections, 3)."""
        return self._sent

    def connect(self) -> None:
        """Open the device, which zeroes its outputs."""
        self._hardware.connect()
        self._sent = self._allowed = self._zeros

    def read(self, time_s: float) -> Measurement:
        """Return the newest measurement."""
        return self._hardware.read(time_s)

    def write(self, pressures_pa: Array, commanded_at_s: float, now_s: float) -> Guarded:
        """Check and send; the slew counts from what the device acknowledged, not from the wish."""
        guarded = self._guard.check(pressures_pa, commanded_at_s, now_s)
        self._sent = self._hardware.write(guarded.pressures_pa, now_s)
        stepped = np.abs(self._sent - guarded.pressures_pa) < STEP_PA
        self._allowed = np.where(stepped, guarded.pressures_pa, self._sent)
        self._guard.acknowledge(self._allowed, now_s)
        return Guarded(self._sent, guarded.intervention)

    def acknowledged(self, at_s: float) -> None:
        """The last write was acknowledged as late as ``at_s``: the next slew counts from there."""
        self._guard.acknowledge(self._allowed, at_s)

    def vent(self, time_s: float) -> None:
        """Set every output to zero."""
        self._hardware.vent(time_s)
        self._sent = self._allowed = self._zeros
        self._guard.acknowledge(self._zeros, time_s)

    def close(self) -> None:
        """Let the device go."""
        self._hardware.close()

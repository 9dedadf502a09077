"""What every device is to the daemon."""

import math
from dataclasses import dataclass
from typing import Protocol

from pneuarm.controllers.arm.arm import Array


@dataclass(frozen=True)
class Measurement:
    """One reading of the device; arrays of shape ``(n_sections, 3)``, NaN where not measured.

    ``taken_s`` is the time of the reading on the loop's clock, None where it was taken for this
    very call. ``setpoints_pa`` is what the device says it was told, ``supply_pa`` the gauge
    pressure before its valves, ``stop_pressed`` its own stop input, and ``complaints`` its
    diagnostics in words. ``true_tip`` is the tip pose ``(position_m (3,), rotation (3, 3))`` that
    only a simulated arm knows; it is recorded, never used for control.
    """

    pressures_pa: Array
    lengths_m: Array
    true_tip: tuple[Array, Array] | None = None
    taken_s: float | None = None
    setpoints_pa: Array | None = None
    supply_pa: float = math.nan
    stop_pressed: bool = False
    complaints: tuple[str, ...] = ()


class Hardware(Protocol):
    """One arm's air. The time is always an argument: no adapter reads a clock.

    The order of calls is ``connect``, then ``read`` and ``write`` once a tick with ``time_s`` never
    going back, then ``vent`` and ``close``. Every method raises HardwareError when the device does
    not answer as it must.
    """

    def connect(self) -> None:
        """Open the device and set every output to zero."""
        ...

    def read(self, time_s: float) -> Measurement:
        """Return the newest measurement."""
        ...

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        """Set gauge pressures (n_sections, 3); return what was really sent."""
        ...

    def vent(self, time_s: float) -> None:
        """Set every output to zero, whatever was written before."""
        ...

    def close(self) -> None:
        """Let the device go. Safe to call twice."""
        ...

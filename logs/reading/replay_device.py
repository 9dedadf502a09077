"""A log in the place of a device: what was measured is measured again, and nothing moves."""

from pathlib import Path

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import ConfigurationError, HardwareError, LogError
from pneuarm.hardware.channels import CallOrder
from pneuarm.hardware.checked import checked_command
from pneuarm.hardware.interface import Measurement
from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.reading.replay import HOLE_S

WHAT = "the replayed log"


class ReplayDevice:
    """Reads a session's pressures and lengths in their time, counted from the first reading.

    It satisfies :class:`pneuarm.hardware.interface.Hardware`. What is written goes nowhere. A hole
    in the log is skipped: the reading behind it follows the one before.
    """

    def __init__(self, arm: Arm, path: Path) -> None:
        """Raise ConfigurationError for a log that is none, or of an arm with other sections."""
        self._arm, self._path = arm, path
        try:
            self._reader = LogReader(path)
        except LogError as error:
            raise ConfigurationError(f"replay.log: {error}") from error
        self._check_sections()
        self._low = arm.per_chamber("pressure_min_pa")
        self._high = arm.per_chamber("pressure_max_pa")
        self._order = CallOrder(WHAT)
        self._times_s: Array = np.zeros(0)

    def _check_sections(self) -> None:
        """Compare number and lengths of the sections; pressures may have other limits."""
        info = self._reader.info
        for name in ("length_min_m", "length_max_m"):
            own = self._arm.per_chamber(name).reshape(-1)
            logged = np.array(getattr(info, name))
            if logged.shape != own.shape or np.abs(logged - own).max() > 1e-6:
                raise ConfigurationError(
                    f"replay.log = {str(self._path)!r} is of arm {info.arm!r}, whose chambers have "
                    f"{name} = {logged.round(4).tolist()}; those of arm {self._arm.name!r} have "
                    f"{own.round(4).tolist()}: give the arm that was recorded"
                )

    def connect(self) -> None:
        """Load the log; raises HardwareError where it holds no ticks."""
        try:
            ticks = self._reader.ticks(
                ("time_unix_ns", "pressure_measured_pa", "length_measured_m")
            )
        except LogError as error:
            raise HardwareError(f"{WHAT} cannot be read: {error}") from error
        if len(ticks) == 0:
            raise HardwareError(f"{WHAT} {self._path} holds no ticks: replay another session")
        steps_s = np.diff(ticks["time_unix_ns"], prepend=ticks["time_unix_ns"][0]) * 1e-9
        self._times_s = np.cumsum(np.where(steps_s > HOLE_S, 0.0, steps_s))
        self._pressures_pa = ticks["pressure_measured_pa"]
        self._lengths_m = ticks["length_measured_m"]
        self._began_s: float | None = None
        self._order.begin()

    def read(self, time_s: float) -> Measurement:
        """Return the newest recorded reading of this time; raises HardwareError after the last."""
        self._order.check(time_s)
        if self._began_s is None:
            self._began_s = time_s
        passed_s = time_s - self._began_s
        index = int(np.searchsorted(self._times_s, passed_s, side="right")) - 1
        if index == len(self._times_s) - 1 and passed_s > self._times_s[-1] + 1.0:
            raise HardwareError(
                f"{WHAT} {self._path} has ended after {self._times_s[-1]:.1f} s: start the daemon "
                "again to see it again"
            )
        return Measurement(
            pressures_pa=self._pressures_pa[index].copy(),
            lengths_m=self._lengths_m[index].copy(),
            taken_s=self._began_s + float(self._times_s[index]),
        )

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        """Return a command within the arm's limits; it moves nothing."""
        self._order.check(time_s)
        return checked_command(pressures_pa, self._low, self._high, WHAT)

    def vent(self, time_s: float) -> None:
        """Do nothing: there is no air."""
        self._order.at_any_time(time_s)

    def close(self) -> None:
        """Let the log go. Safe to call twice."""
        self._order.end()

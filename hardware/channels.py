"""From chambers to a device's channels and back, and commands in whole steps of its unit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import ConfigurationError, HardwareError
from pneuarm.hardware.checked import checked_command


def valves_or_all(valves: tuple[int, ...], n_chambers: int) -> tuple[int, ...]:
    """Return the valve or channel of every chamber: 0, 1, 2, ... where none is named."""
    return valves or tuple(range(n_chambers))


@dataclass(frozen=True)
class Channels:
    """Which of ``count`` channels, counted from 0, feeds each chamber, section by section.

    Raises ConfigurationError where a chamber has none, or one that another has already; ``key``
    is what the list is called in the configuration.
    """

    arm: Arm
    count: int
    of_chambers: tuple[int, ...]
    key: str

    def __post_init__(self) -> None:
        """Check the list against the arm and the device."""
        chambers, given = self.arm.n_chambers, list(self.of_chambers)
        if self.count < chambers:
            raise ConfigurationError(
                f"{self.key}: the device has {self.count} channels, and arm {self.arm.name!r} has "
                f"{chambers} chambers, each of which needs one"
            )
        if len(given) != chambers:
            raise ConfigurationError(
                f"{self.key} = {given}: {chambers} channels are needed, one for every chamber of "
                f"arm {self.arm.name!r}, section by section"
            )
        if len(set(given)) != chambers or not all(0 <= number < self.count for number in given):
            raise ConfigurationError(
                f"{self.key} = {given}: every chamber needs a channel of its own, 0 to "
                f"{self.count - 1}"
            )

    def scatter(self, per_chamber: Array) -> list[float]:
        """Values of all channels for values (n_sections, 3); channels without a chamber get 0."""
        values = [0.0] * self.count
        for channel, value in zip(self.of_chambers, per_chamber.reshape(-1).tolist(), strict=True):
            values[channel] = value
        return values

    def gather(self, per_channel: Sequence[float]) -> Array:
        """Values (n_sections, 3) out of those of all channels."""
        chosen = [per_channel[channel] for channel in self.of_chambers]
        return np.array(chosen, dtype=np.float64).reshape(self.arm.n_sections, 3)


class StepCommand:
    """Commands in whole steps of the device's unit, never outside the arm's limits."""

    def __init__(self, arm: Arm, step_pa: float, what: str) -> None:
        self._low, self._high = (
            arm.per_chamber("pressure_min_pa"),
            arm.per_chamber("pressure_max_pa"),
        )
        self._step_pa, self._what = step_pa, what
        # A limit between two steps: the last step before it. The millionth is for rounding.
        self._first = np.ceil(self._low / step_pa - 1e-6)
        self._last = np.floor(self._high / step_pa + 1e-6)

    def sendable_pa(self, pressures_pa: Array) -> Array:
        """Return the nearest pressures (n_sections, 3) that can be sent; a new array.

        Raises HardwareError for a wrong shape and for elements that are no numbers.
        """
        taken_pa = checked_command(pressures_pa, self._low, self._high, self._what)
        steps = np.clip(np.rint(taken_pa / self._step_pa), self._first, self._last)
        # Adding 0.0 makes a negative zero positive.
        sendable: Array = np.clip(steps * self._step_pa, self._low, self._high) + 0.0
        return sendable


class CallOrder:
    """Whether a device may be called now: connected, and time has not run back."""

    def __init__(self, what: str) -> None:
        self._what = what
        self._newest_s: float | None = None

    def begin(self) -> None:
        """Allow calls, from any time on."""
        self._newest_s = -np.inf

    def end(self) -> None:
        """Allow no more calls."""
        self._newest_s = None

    def check(self, time_s: float) -> None:
        """Raise HardwareError unless a call at ``time_s`` is allowed."""
        if self._newest_s is None:
            raise HardwareError(f"{self._what} is not connected: call connect() first")
        if not self._newest_s <= time_s < np.inf:
            raise HardwareError(
                f"time_s = {time_s:.6f} for {self._what}: time must be finite and not run back "
                f"behind {self._newest_s:.6f}"
            )
        self._newest_s = time_s

    def at_any_time(self, time_s: float) -> float:
        """Return the time for a call that is never refused for its time: venting."""
        if self._newest_s is None:
            self.check(time_s)
            return time_s
        self._newest_s = max(self._newest_s, time_s) if np.isfinite(time_s) else self._newest_s
        return self._newest_s

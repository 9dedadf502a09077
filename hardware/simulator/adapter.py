"""The simulated arm behind the interface of every device."""

from collections.abc import Callable
from math import ceil
from typing import Protocol

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.interface import Measurement
from pneuarm.hardware.simulator.flow_valves import valve_of
from pneuarm.hardware.simulator.parameters import DrawnParameters, SimulatorParameters, draw
from pneuarm.hardware.simulator.pneumatics import Chamber
from pneuarm.hardware.simulator.rod import Rod

#: Longest step of the physics; a longer time between two reads is cut into equal parts.
LARGEST_STEP_S = 2.5e-3

#: Sensor noise is drawn for this many readings at once.
_NOISE_BLOCK = 256


class Body(Protocol):
    """What the chambers move. ``lowest_mode_hz`` is the drawn arm's own, at rest."""

    lowest_mode_hz: float

    def reset(self) -> None:
        """Put the arm at rest: vented, hanging as its gravity has it."""
        ...

    def step(self, lengthening_m: Array, step_s: float) -> None:
        """Advance by ``step_s`` under lengthenings (n_chambers,) of unloaded chambers."""
        ...

    def tip(self) -> tuple[Array, Array]:
        """Tip position (3,) in m and rotation (3, 3), in the base frame; copies."""
        ...


#: Makes the body of a drawn arm; raises InvalidInput for one that cannot hold itself.
MakeBody = Callable[[Arm, DrawnParameters], Body]


class _Noise:
    """Gaussian noise of the pressure sensors, drawn in blocks: one reading is one look-up."""

    def __init__(self, shape: tuple[int, int], sigma_pa: float, seed: int) -> None:
        # A stream of its own, so that it does not repeat the numbers the parameters came from.
        self._generator = np.random.Generator(np.random.PCG64([seed, 1]))
        self._shape, self._sigma_pa = shape, sigma_pa
        self._block: list[Array] = []

    def next_pa(self) -> Array:
        """Noise of one reading, (n_sections, 3)."""
        if not self._block:
            block = self._generator.normal(0.0, self._sigma_pa, (_NOISE_BLOCK, *self._shape))
            self._block = list(block)
        return self._block.pop()


class SimulatedArm:
    """An arm of air and mass that obeys other equations than the controller's.

    It satisfies :class:`pneuarm.hardware.interface.Hardware`. Nothing here reads a clock: the same
    calls with the same seed give the same bits. ``drawn`` holds every parameter for the session
    log.
    """

    def __init__(
        self, arm: Arm, nominal: SimulatorParameters, seed: int, make_body: MakeBody = Rod
    ) -> None:
        drawn = draw(nominal, seed, arm.n_sections)
        self._arm = arm
        self._body = make_body(arm, drawn)
        self.drawn = drawn.with_lowest_mode(self._body.lowest_mode_hz)
        self._low_pa = arm.per_chamber("pressure_min_pa")
        self._high_pa = arm.per_chamber("pressure_max_pa")
        self._no_lengths = np.full((arm.n_sections, 3), np.nan)
        self._no_lengths.setflags(write=False)
        self._connected = False

    def connect(self) -> None:
        """Put the arm at rest, vented; the next read sets its clock."""
        values = self.drawn.values
        self._body.reset()
        self._valve = valve_of(self._arm, values)
        self._chamber = Chamber(self._arm, values)
        shape = (self._arm.n_sections, 3)
        self._noise = _Noise(shape, values.sensor_noise_pa, self.drawn.seed)
        self._simulated_to_s: float | None = None
        self._newest_call_s = -np.inf
        self._connected = True

    def read(self, time_s: float) -> Measurement:
        """Advance the physics to ``time_s``; return noisy pressures, no lengths, the true tip.

        Raises HardwareError when not connected or when the time runs backwards.
        """
        self._check_call(time_s)
        if self._simulated_to_s is None:
            self._simulated_to_s = time_s
        self._advance(self._simulated_to_s, time_s)
        self._simulated_to_s = time_s
        measured_pa = self._valve.pressures_pa + self._noise.next_pa()
        return Measurement(measured_pa, self._no_lengths, self._body.tip())

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        """Set gauge pressures (n_sections, 3); return the setpoints that the valves took.

        A valve takes no setpoint outside its range, but any value inside it: how finely it then
        regulates is its own affair. Raises HardwareError for a command that is no set of numbers
        of the arm's shape, when not connected, or when the time runs backwards.
        """
        self._check_call(time_s)
        if pressures_pa.shape != self._low_pa.shape or not np.isfinite(pressures_pa).all():
            raise HardwareError(
                f"pressures_pa = {pressures_pa.tolist()}: the simulated arm takes finite numbers "
                f"of shape {self._low_pa.shape}"
            )
        taken_pa = np.minimum(np.maximum(pressures_pa, self._low_pa), self._high_pa)
        self._valve.command(taken_pa, time_s)
        return taken_pa

    def vent(self, time_s: float) -> None:
        """Open every valve to ambient, whatever was written before."""
        self._check_call(time_s)
        self._valve.vent(time_s)

    def close(self) -> None:
        """Let the simulated arm go. Safe to call twice."""
        self._connected = False

    def _check_call(self, time_s: float) -> None:
        if not self._connected:
            raise HardwareError("the simulated arm is not connected: call connect() first")
        if not self._newest_call_s <= time_s < np.inf:
            raise HardwareError(
                f"time_s = {time_s:.6f} on the simulated arm: time must be finite and not run "
                f"back behind {self._newest_call_s:.6f}"
            )
        self._newest_call_s = time_s

    def _advance(self, from_s: float, to_s: float) -> None:
        """Air first, then the body under it, in equal steps."""
        steps = ceil((to_s - from_s) / LARGEST_STEP_S)
        for index in range(steps):
            start_s = from_s + (to_s - from_s) * index / steps
            end_s = from_s + (to_s - from_s) * (index + 1) / steps
            self._valve.advance(start_s, end_s)
            self._chamber.advance(self._valve.pressures_pa, end_s - start_s)
            self._body.step(self._chamber.lengthening_m.reshape(-1), end_s - start_s)

"""Faults of an emulated valve terminal, injected by words: its physics, never its messages.

One line is one fault: ``valve-stuck-open N``, ``valve-stuck-closed N``, ``leak N``,
``supply-lost``, ``sensor-nan N``, ``sensor-frozen N``, ``sensor-offset N BAR``,
``sensor-noisy N``, ``stop-pressed``; ``clear`` takes all of them away. ``N`` counts the chambers
from 0, section by section from the base, as the configuration's lists of valves do.
"""

from dataclasses import dataclass
from math import exp, isfinite

import numpy as np
from numpy.typing import NDArray

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import InvalidInput

BAR_PA = 1e5

#: A leak of this time constant (s) leaves about 0.4 of the setpoint against the nominal valve.
LEAK_TIME_S = 0.04
#: How fast a valve that is stuck open fills its chamber, and how fast a lost supply runs empty.
STUCK_OPEN_TIME_S = 0.06
SUPPLY_EMPTY_TIME_S = 0.5
#: How fast the chambers empty when the terminal's own stop takes the power from the valves.
STOP_TIME_S = 0.06
#: Standard deviation of a noisy sensor: far above the 200 Pa of a good one.
NOISY_PA = 2.0e4

PHYSICAL_WORDS = (
    "valve-stuck-open N",
    "valve-stuck-closed N",
    "leak N",
    "supply-lost",
    "sensor-nan N",
    "sensor-frozen N",
    "sensor-offset N BAR",
    "sensor-noisy N",
    "stop-pressed",
    "clear",
)
_WORDS = {line.split()[0]: line.split()[1:] for line in PHYSICAL_WORDS}


@dataclass
class _State:
    """Which faults there are; arrays over all chambers, flat."""

    stuck_open: NDArray[np.bool_]
    stuck_closed: NDArray[np.bool_]
    leak: NDArray[np.bool_]
    sensor_nan: NDArray[np.bool_]
    sensor_frozen: NDArray[np.bool_]
    sensor_noisy: NDArray[np.bool_]
    sensor_offset_pa: Array
    supply_lost: bool = False
    stop_pressed: bool = False


def _no_faults(n_chambers: int) -> _State:
    return _State(
        stuck_open=np.zeros(n_chambers, dtype=bool),
        stuck_closed=np.zeros(n_chambers, dtype=bool),
        leak=np.zeros(n_chambers, dtype=bool),
        sensor_nan=np.zeros(n_chambers, dtype=bool),
        sensor_frozen=np.zeros(n_chambers, dtype=bool),
        sensor_noisy=np.zeros(n_chambers, dtype=bool),
        sensor_offset_pa=np.zeros(n_chambers),
    )


class EmulatedFaults:
    """The faults of one emulated arm, and what they do to its air and to its sensors."""

    def __init__(self, n_chambers: int, supply_pa: float, seed: int) -> None:
        self._n_chambers, self._full_supply_pa = n_chambers, supply_pa
        self._generator = np.random.Generator(np.random.PCG64([seed, 2]))
        self._state = _no_faults(n_chambers)
        self._frozen_pa: Array | None = None
        self.supply_pa = supply_pa

    @property
    def stop_pressed(self) -> bool:
        """Whether the terminal's own stop is pressed."""
        return self._state.stop_pressed

    def inject(self, words: str) -> None:
        """Take one line; raises InvalidInput for one that means nothing."""
        name, *values = words.split() or [""]
        if name not in _WORDS or len(values) != len(_WORDS[name]):
            raise InvalidInput(f"fault {words!r}: allowed: {', '.join(PHYSICAL_WORDS)}")
        state = self._state
        match name:
            case "clear":
                self._state, self._frozen_pa = _no_faults(self._n_chambers), None
            case "supply-lost":
                state.supply_lost = True
            case "stop-pressed":
                state.stop_pressed = True
            case "sensor-offset":
                state.sensor_offset_pa[self._chamber(words, values[0])] = _bar(words, values[1])
            case _:
                mask = getattr(state, name.removeprefix("valve-").replace("-", "_"))
                mask[self._chamber(words, values[0])] = True

    def _chamber(self, words: str, value: str) -> int:
        if not value.isdecimal() or int(value) >= self._n_chambers:
            raise InvalidInput(f"fault {words!r}: chambers are 0 to {self._n_chambers - 1}")
        return int(value)

    def bend_air(self, before_pa: Array, healthy_pa: Array, step_s: float) -> Array:
        """Return the pressures (n_chambers,) after a step that healthy valves would have ended at.

        ``before_pa`` are those before it.
        """
        state, pressures_pa = self._state, healthy_pa
        supply_goal_pa = 0.0 if state.supply_lost else self._full_supply_pa
        supply_rest = exp(-step_s / SUPPLY_EMPTY_TIME_S)
        self.supply_pa = supply_goal_pa + supply_rest * (self.supply_pa - supply_goal_pa)
        if state.stuck_open.any():
            filling_pa = _toward(before_pa, self._full_supply_pa, step_s, STUCK_OPEN_TIME_S)
            pressures_pa = np.where(state.stuck_open, filling_pa, pressures_pa)
        if state.stop_pressed:
            pressures_pa = _toward(before_pa, 0.0, step_s, STOP_TIME_S)
        if state.stuck_closed.any():
            pressures_pa = np.where(state.stuck_closed, before_pa, pressures_pa)
        if state.leak.any():
            leaking_pa = _toward(pressures_pa, 0.0, step_s, LEAK_TIME_S)
            pressures_pa = np.where(state.leak, leaking_pa, pressures_pa)
        if self.supply_pa < 0.999 * self._full_supply_pa:
            pressures_pa = np.clip(pressures_pa, -self.supply_pa, self.supply_pa)
        return pressures_pa

    def bend_reading(self, read_pa: Array) -> Array:
        """Return what the sensors say (n_chambers,) where healthy ones would read ``read_pa``."""
        state = self._state
        read_pa = read_pa + state.sensor_offset_pa
        if state.sensor_noisy.any():
            noise_pa = self._generator.normal(0.0, NOISY_PA, self._n_chambers)
            read_pa = np.where(state.sensor_noisy, read_pa + noise_pa, read_pa)
        if state.sensor_frozen.any() and self._frozen_pa is not None:
            read_pa = np.where(state.sensor_frozen, self._frozen_pa, read_pa)
        self._frozen_pa = read_pa
        return np.where(state.sensor_nan, np.nan, read_pa)


def _toward(values: Array, goal: float, step_s: float, time_s: float) -> Array:
    """First-order lag with time constant ``time_s``."""
    return goal + exp(-step_s / time_s) * (values - goal)


def _bar(words: str, value: str) -> float:
    try:
        pressure_bar = float(value)
    except ValueError:
        pressure_bar = float("nan")
    if not isfinite(pressure_bar):
        raise InvalidInput(f"fault {words!r}: {value!r} is no pressure in bar")
    return pressure_bar * BAR_PA

"""Lines <-> values of the valve box; no transport here.

``P 1200 0 -300`` sets the valves (mbar gauge, one value a chamber), ``M`` asks; the box answers
both with what it measures, ``1198 2 -305``. Without a line for 200 ms it empties itself.
"""

import numpy as np

from pneuarm.controllers.arm.arm import Array

#: Pa of one step.
STEP_PA = 100.0
WATCHDOG_S = 0.2

MEASURE = b"M\n"


def set_line(pressures_pa: Array) -> bytes:
    """Return the line that sets pressures (n_sections, 3), which are whole steps."""
    steps = np.rint(pressures_pa.reshape(-1) / STEP_PA).astype(int).tolist()
    return f"P {' '.join(map(str, steps))}\n".encode()


def answer_line(pressures_pa: Array) -> bytes:
    """Return the box's answer for the pressures that it measures."""
    values = pressures_pa.reshape(-1) / STEP_PA
    return " ".join(f"{value:.0f}" for value in values).encode() + b"\n"


def values_pa(words: bytes, n_sections: int) -> Array:
    """Return the pressures (n_sections, 3) of a line; raises ValueError for any other line."""
    values = [STEP_PA * float(word) for word in words.split()]
    return np.array(values).reshape(n_sections, 3)

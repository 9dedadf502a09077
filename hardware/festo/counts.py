"""Pressures <-> counts of 1 mbar, as both Festo terminals count them."""

from math import copysign

import numpy as np

from pneuarm.controllers.arm.arm import Array

#: Pa of one count.
COUNT_PA = 100.0

#: A command this near (counts) below a count is that count: 300 mbar is never sent as 299.
_COUNT_TOLERANCE = 1e-6


def counts_of(pressures_pa: Array) -> list[int]:
    """Return whole counts, flat: the nearest that are no further from ambient than asked for."""
    flat: list[float] = pressures_pa.reshape(-1).tolist()
    return [int(value / COUNT_PA + copysign(_COUNT_TOLERANCE, value)) for value in flat]


def pressures_of(counts: list[int], n_sections: int) -> Array:
    """Return gauge pressures (n_sections, 3) in Pa."""
    return np.array(counts, dtype=np.float64).reshape(n_sections, 3) * COUNT_PA

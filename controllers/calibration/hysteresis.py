"""The play (backlash) that stands for a chamber's hysteresis, over a whole recording, and back.

A play of half width w holds its output until the input has pushed it: the output is the last one
clipped to ``input - w .. input + w``.
"""

from itertools import accumulate
from typing import Any

import numpy as np

from pneuarm.controllers.arm.arm import Array


def play_outputs(pressures_pa: Array, half_width_pa: Array) -> tuple[Array, Array]:
    """Output of the play, and its derivative over the half width, at every sample.

    ``pressures_pa`` (samples, n_sections, 3) is the whole history from an arm that was vented,
    ``half_width_pa`` (n_sections, 1) or alike. Both results have the shape of the pressures.
    """
    low = (pressures_pa - half_width_pa).reshape(len(pressures_pa), -1)
    high = (pressures_pa + half_width_pa).reshape(len(pressures_pa), -1)
    outputs = np.stack([_clipped(*pair) for pair in zip(low.T, high.T, strict=True)], axis=1)
    # The play moves with the bound that pushed it last.
    pushed = np.where(outputs == low, -1.0, np.where(outputs == high, 1.0, 0.0))
    rows = np.where(pushed != 0.0, np.arange(len(low))[:, None], 0)
    slopes = np.take_along_axis(pushed, np.maximum.accumulate(rows, axis=0), axis=0)
    return outputs.reshape(pressures_pa.shape), slopes.reshape(pressures_pa.shape)


def turning_points(pressures_pa: Array, kept: "np.ndarray[Any, np.dtype[np.int64]]") -> Array:
    """Samples (rows, ascending) that give the play the same outputs at ``kept``: where it may turn.

    Between two turns a play depends on their ends alone.
    """
    flat = pressures_pa.reshape(len(pressures_pa), -1)
    ways = np.sign(np.diff(flat, axis=0))
    turns = np.flatnonzero((ways[1:] != ways[:-1]).any(axis=1)) + 1
    rows: Array = np.union1d(turns, np.union1d(kept, [0]))
    return rows


def _clipped(low: Array, high: Array) -> Array:
    """Clip a running value, 0 before the first sample, to every pair of bounds (samples,)."""

    def clip(last: float, bounds: tuple[float, float]) -> float:
        lowest, highest = bounds
        return lowest if last < lowest else highest if last > highest else last

    pairs = zip(low.tolist(), high.tolist(), strict=True)
    return np.fromiter(accumulate(pairs, clip, initial=0.0), float)[1:]

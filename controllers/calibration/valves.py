"""What valves make of the pressures they are sent: a dead time and a lag, on an even grid."""

import numpy as np
from scipy.signal import lfilter

from pneuarm.controllers.arm.arm import Array

#: The grid (s).
STEP_S = 0.005


def on_grid(time_s: Array, values: Array) -> tuple[Array, Array]:
    """Values (samples, ...) on an even grid of ``STEP_S``: its times, and the values there."""
    grid_s = np.arange(time_s[0], time_s[-1] + 0.5 * STEP_S, STEP_S)
    flat = values.reshape(len(values), -1)
    columns = [np.interp(grid_s, time_s, column) for column in flat.T]
    return grid_s, np.stack(columns, axis=1).reshape(-1, *values.shape[1:])


def lagged(sent_pa: Array, delay_s: float, lag_s: float) -> Array:
    """Pressures (points, ...) after a dead time and a lag of first order, on the grid."""
    steps = delay_s / STEP_S
    whole = int(steps)
    padded = np.concatenate([np.repeat(sent_pa[:1], whole + 1, axis=0), sent_pa])
    late = padded[1 : len(sent_pa) + 1] * (1.0 - steps + whole)
    late = late + padded[: len(sent_pa)] * (steps - whole)
    kept = np.exp(-STEP_S / max(lag_s, 1e-6))
    # What comes in between two points of the grid is their mean.
    entering = 0.5 * (late + np.concatenate([late[:1], late[:-1]]))
    start = [kept * late[0]]
    behind: Array = lfilter([1.0 - kept], [1.0, -kept], entering, axis=0, zi=np.array(start))[0]
    return behind

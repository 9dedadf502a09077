"""What valves make of the pressures they are sent: a dead time and a lag, on an even grid."""

from itertools import accumulate

import numpy as np

from pneuarm.controllers.arm.arm import Array, Response

#: The grid (s): that of the recordings.
STEP_S = 0.01


def on_grid(time_s: Array, values: Array) -> tuple[Array, Array]:
    """Values (samples, ...) on an even grid of ``STEP_S``: its times, and the values there."""
    grid_s = np.arange(time_s[0], time_s[-1] + 0.5 * STEP_S, STEP_S)
    flat = values.reshape(len(values), -1)
    columns = [np.interp(grid_s, time_s, column) for column in flat.T]
    return grid_s, np.stack(columns, axis=1).reshape(-1, *values.shape[1:])


def delayed(sent_pa: Array, delay_s: float) -> Array:
    """Pressures (points, ...) after a dead time, on the grid; nothing was sent before the first."""
    steps = delay_s / STEP_S
    whole = int(steps)
    padded = np.concatenate([np.zeros((whole + 1, *sent_pa.shape[1:])), sent_pa])
    late: Array = padded[1 : len(sent_pa) + 1] * (1.0 - steps + whole)
    return late + padded[: len(sent_pa)] * (steps - whole)


def lagged(sent_pa: Array, response: Response) -> Array:
    """Pressures (points, ...) behind dead time and lags of :class:`Response`, on the grid.

    The chambers were vented before the first point.
    """
    late = delayed(sent_pa, response.delay_s)
    # What comes in between two points of the grid is their mean.
    entering = 0.5 * (late + np.concatenate([np.zeros_like(late[:1]), late[:-1]]))
    filling, exhausting = response.left(STEP_S)

    def follow(now: float, toward: float) -> float:
        return toward + (filling if toward > now else exhausting) * (now - toward)

    columns = [
        np.fromiter(accumulate(column.tolist(), follow, initial=0.0), float)[1:]
        for column in entering.reshape(len(entering), -1).T
    ]
    return np.stack(columns, axis=1).reshape(sent_pa.shape)

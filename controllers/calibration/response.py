"""How the arm answers: dead time and lag of its valves, frequency and damping of its lowest mode.

Two fits. The pressures measured are the pressures sent, through a play, a dead time and a lag of
first order. The tip after a step is where the map says, through an oscillator of second order; the
map's own error is taken out by an offset and a gain for every step.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from pneuarm.controllers.arm.arm import Arm, Array, Response
from pneuarm.controllers.arm.errors import CalibrationError
from pneuarm.controllers.calibration.frames import Frames
from pneuarm.controllers.calibration.hysteresis import play_outputs
from pneuarm.controllers.calibration.model import TipModel
from pneuarm.controllers.calibration.parameters import start_of
from pneuarm.controllers.calibration.recording import STILL_PA_S, Recording

#: The fits run on this grid (s).
STEP_S = 0.005
#: A stretch of motion this near the fastest one of the recording is a step.
_FAST_SHARE = 0.7
#: How long after the beginning of a step the tip is looked at, and the pressures may move (s).
_WINDOW_S, _MOVING_S = 2.0, 0.8
#: A step must move the tip this far (m) to tell a mode from noise.
_MOVED_M = 0.01


@dataclass(frozen=True)
class StepAnswer:
    """One step: time from its beginning (s), the tip measured and modelled along its way, m."""

    time_s: Array
    measured_m: Array
    modelled_m: Array


@dataclass(frozen=True)
class ResponseFit:
    """The response, the standard deviations of its four numbers, and the steps behind it."""

    response: Response
    sd: Response
    steps: tuple[StepAnswer, ...]


def fit_response(arm: Arm, recording: Recording, frames: Frames) -> ResponseFit:
    """Fit the response of ``arm``, whose map and ``frames`` of measurement are fitted already.

    Raises CalibrationError for a recording without a step.
    """
    grid = _Grid(recording)
    (delay_s, lag_s, _), valve_sd = _fit_valves(grid, arm.response)
    windows = grid.steps()
    acting, _ = play_outputs(
        _lagged(grid.sent_pa, delay_s, lag_s), arm.per_section("hysteresis_pa")
    )
    model, start = TipModel(arm), start_of(arm)
    static_m = [frames.measured_m(model.poses(acting[window], start)) for window in windows]
    mode, mode_sd, steps = _fit_mode(grid, windows, static_m, arm.response)
    if not steps:
        raise CalibrationError(_NO_STEP)
    return ResponseFit(
        _response(delay_s, lag_s, *mode),
        _response(valve_sd[0], valve_sd[1], *mode_sd),
        steps,
    )


def _response(*values: float) -> Response:
    return Response(*(float(value) for value in values))


_NO_STEP = (
    "the arm was never moved by a step: pressures must change quickly, the tip by 10 mm or more, "
    f"and then rest for {_WINDOW_S:g} s, to show how it swings"
)


class _Grid:
    """A recording on an even grid of time."""

    def __init__(self, recording: Recording) -> None:
        time_s = recording.time_s
        self.time_s = np.arange(time_s[0], time_s[-1], STEP_S)
        self.sent_pa = self._even(time_s, recording.sent_pa)
        self.measured_pa = self._even(time_s, recording.measured_pa)
        seen = np.isfinite(recording.tip_m).all(axis=1)
        self.tip_m = self._even(time_s[seen], recording.tip_m[seen])

    def _even(self, time_s: Array, values: Array) -> Array:
        flat = values.reshape(len(values), -1)
        columns = [np.interp(self.time_s, time_s, column) for column in flat.T]
        return np.stack(columns, axis=1).reshape(-1, *values.shape[1:])

    def steps(self) -> list[slice]:
        """Windows that begin with a fast motion, and in which the pressures soon rest again."""
        change = np.abs(np.diff(self.sent_pa.reshape(len(self.time_s), -1), axis=0)).max(axis=1)
        fast = np.flatnonzero(change > _FAST_SHARE * change.max(initial=0.0))
        moving = np.append(change > STILL_PA_S * STEP_S, False)
        size, soon = round(_WINDOW_S / STEP_S), round(_MOVING_S / STEP_S)
        windows: list[slice] = []
        for index in fast:
            window = slice(index, index + size)
            apart = not windows or index >= windows[-1].stop
            if apart and window.stop <= len(moving) and not moving[window][soon:].any():
                windows.append(window)
        return windows


def _lagged(sent_pa: Array, delay_s: float, lag_s: float) -> Array:
    """Pressures after a dead time and a lag of first order, on the grid."""
    steps = delay_s / STEP_S
    whole = int(steps)
    padded = np.concatenate([np.repeat(sent_pa[:1], whole + 1, axis=0), sent_pa])
    late = padded[1 : len(sent_pa) + 1] * (1.0 - steps + whole)
    late = late + padded[: len(sent_pa)] * (steps - whole)
    kept = np.exp(-STEP_S / max(lag_s, 1e-6))
    # What comes in between two points of the grid is their mean.
    entering = 0.5 * (late + np.concatenate([late[:1], late[:-1]]))
    start = [kept * late[0]]
    lagged: Array = lfilter([1.0 - kept], [1.0, -kept], entering, axis=0, zi=np.array(start))[0]
    return lagged


def _fit_valves(grid: _Grid, nominal: Response) -> tuple[Array, Array]:
    """Dead time (s), lag (s) and half width of the valves' play (Pa), and their deviations."""
    finite = np.isfinite(grid.measured_pa).reshape(len(grid.time_s), -1).all(axis=1)
    if not finite.all():
        raise CalibrationError(
            "the device measured no pressures: without them the lag of the valves is not seen"
        )

    def rows(x: Array) -> Array:
        played, _ = play_outputs(grid.sent_pa, np.array([[x[2] * 1e3]]))
        modelled = _lagged(played, x[0], x[1])
        return (modelled - grid.measured_pa).reshape(-1) * 1e-3

    start = np.array([max(nominal.delay_s, 1e-3), max(nominal.lag_s, 1e-3), 0.5])
    x, sd = _solved(rows, start, (0.0, 1e-4, 0.0), (0.45, 4.0, 20.0))
    return x, sd


def _solved(
    rows: Callable[[Array], Array], start: Array, low: Sequence[float], high: Sequence[float]
) -> tuple[Array, Array]:
    """Least squares within bounds; the solution and its standard deviations."""
    found = least_squares(rows, start, bounds=(low, high), x_scale=np.maximum(start, 1e-3))
    freedom = max(1, len(found.fun) - len(start))
    variance = 2.0 * found.cost / freedom
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * variance
    return found.x, np.sqrt(np.diag(covariance))


def _fit_mode(
    grid: _Grid, windows: list[slice], static_m: list[Array], nominal: Response
) -> tuple[Array, Array, tuple[StepAnswer, ...]]:
    """Frequency (Hz) and damping ratio of the lowest mode, their deviations, and the steps."""
    moved = [
        (static @ direction, grid.tip_m[window] @ direction)
        for window, static in zip(windows, static_m, strict=True)
        if np.ptp(static @ (direction := _direction(static))) > _MOVED_M
    ]

    def answers(x: Array) -> list[StepAnswer]:
        found = []
        for static, measured in moved:
            modelled = _swinging(static, x[0], x[1])
            columns = np.column_stack([modelled, np.ones_like(modelled)])
            gain, offset = np.linalg.lstsq(columns, measured, rcond=None)[0]
            time_s: Array = STEP_S * np.arange(len(measured), dtype=np.float64)
            found.append(StepAnswer(time_s, measured, np.asarray(gain * modelled + offset)))
        return found

    def rows(x: Array) -> Array:
        return np.concatenate([1e3 * (a.modelled_m - a.measured_m) for a in answers(x)])

    if not moved:
        return np.zeros(2), np.zeros(2), ()
    start = np.array([nominal.mode_hz, nominal.damping_ratio])
    tries = [
        _solved(rows, start * np.array([factor, 1.0]), (0.05, 0.005), (50.0, 1.5))
        for factor in (0.7, 1.0, 1.4)
    ]
    x, sd = min(tries, key=lambda each: float(np.sum(rows(each[0]) ** 2)))
    return x, sd, tuple(answers(x))


def _direction(static_m: Array) -> Array:
    """Direction (3,) in which a step moves the tip most."""
    direction: Array = np.linalg.svd(static_m - static_m.mean(axis=0), full_matrices=False)[2][0]
    return direction


def _swinging(static: Array, mode_hz: float, damping_ratio: float) -> Array:
    """Output of an oscillator that starts at rest, driven by ``static``: bilinear transform."""
    omega = 2.0 * np.pi * mode_hz
    warped = 2.0 * np.tan(0.5 * omega * STEP_S) / STEP_S
    k = 2.0 / STEP_S
    over = [
        k**2 + 2.0 * damping_ratio * warped * k + warped**2,
        2.0 * (warped**2 - k**2),
        k**2 - 2.0 * damping_ratio * warped * k + warped**2,
    ]
    under = warped**2 * np.array([1.0, 2.0, 1.0])
    swung: Array = lfilter(under, over, static - static[0]) + static[0]
    return swung

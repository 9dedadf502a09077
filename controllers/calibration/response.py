"""How the arm answers: dead time and lag of its valves, frequency and damping of its lowest mode.

Two fits. The pressures measured are the pressures sent, through a play, a dead time and a lag of
first order. The tip after a step is where the map says, through an oscillator of second order; the
map's own error is taken out by an offset and a gain for every step.

Either is taken only where it explains what was measured: a feedback that trusts a mode which was
not seen, or a dead time that stands for something else, swings for ever.
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
from pneuarm.controllers.calibration.valves import STEP_S, lagged, on_grid

#: A stretch of motion this near the fastest one of the recording is a step.
_FAST_SHARE = 0.7
#: How long after the beginning of a step the tip is looked at, and the pressures may move (s).
_WINDOW_S, _MOVING_S = 2.0, 0.8
#: A step must move the tip this far (m) to tell a mode from noise.
_MOVED_M = 0.01

_VALVES_LOW, _VALVES_HIGH = (0.0, 1e-4, 0.0), (0.45, 4.0, 20.0)
_MODE_LOW, _MODE_HIGH = (0.05, 0.005), (50.0, 1.5)
#: Frequencies (Hz) and damping ratios from which the mode is looked for.
_MODES_HZ, _DAMPINGS = np.geomspace(0.3, 15.0, 18), (0.05, 0.2, 0.6)

#: Of what the pressures move, the valves' model may leave this share, and of the tip's swing about
#: its way the mode's may leave that one.
_VALVES_LEFT, _MODE_LEFT = 0.08, 0.4
#: Filling and exhausting may differ by this factor in their lag.
_LOPSIDED = 1.5
#: A dead time beyond this (s) and beyond this share of the lag is no dead time.
_DELAY_S, _DELAY_SHARE = 0.06, 1.0
#: A deviation may be this share of its frequency.
_UNSURE = 0.1


@dataclass(frozen=True)
class StepAnswer:
    """One step: time from its beginning (s), the tip measured and modelled along its way, m."""

    time_s: Array
    measured_m: Array
    modelled_m: Array


@dataclass(frozen=True)
class ValvesFit:
    """Dead time and lag as fitted, the width of the valves' loop, their deviations.

    ``why_not`` says why they are not the valves' own, or is empty.
    """

    delay_s: float
    lag_s: float
    play_pa: float
    sd: Array
    why_not: str


@dataclass(frozen=True)
class ResponseFit:
    """The response, the standard deviations of its four numbers, and the steps behind it.

    What was not identified is as it was, with a deviation of 0; ``not_identified`` says what and
    why, one sentence each.
    """

    response: Response
    sd: Response
    steps: tuple[StepAnswer, ...]
    not_identified: tuple[str, ...] = ()


def fit_response(
    arm: Arm, recording: Recording, frames: Frames, valves: "ValvesFit | None" = None
) -> ResponseFit:
    """Fit the response of ``arm``, whose map and ``frames`` of measurement are fitted already.

    Raises CalibrationError for a recording without a step.
    """
    grid, nominal = _Grid(recording), arm.response
    valves = valves or fit_valves(recording, nominal)
    windows = grid.steps()
    # The pressures in the chambers are measured, whatever the valves do; else they are modelled.
    chambers = grid.measured_pa
    if not np.isfinite(chambers).all():
        chambers = lagged(grid.sent_pa, valves.delay_s, valves.lag_s)
    acting, _ = play_outputs(chambers, arm.per_section("hysteresis_pa"))
    model, start = TipModel(arm), start_of(arm)
    static_m = [frames.measured_m(model.poses(acting[window], start)) for window in windows]
    mode = _fit_mode(grid, windows, static_m, nominal)
    reasons = [
        f"{what} not identified: {why}; feedback keeps the nominal {what}"
        for what, why in (("valve response", valves.why_not), ("mode", mode.why_not))
        if why
    ]
    delay_s, lag_s = (
        (nominal.delay_s, nominal.lag_s) if valves.why_not else (valves.delay_s, valves.lag_s)
    )
    own = (nominal.mode_hz, nominal.damping_ratio) if mode.why_not else mode.values
    return ResponseFit(
        _response(delay_s, lag_s, *own),
        _response(
            *(np.zeros(2) if valves.why_not else valves.sd[:2]),
            *(np.zeros(2) if mode.why_not else mode.sd),
        ),
        mode.steps,
        tuple(reasons),
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
        self.time_s, self.sent_pa = on_grid(time_s, recording.sent_pa)
        _, self.measured_pa = on_grid(time_s, recording.measured_pa)
        seen = np.isfinite(recording.tip_m).all(axis=1)
        columns = [np.interp(self.time_s, time_s[seen], each) for each in recording.tip_m[seen].T]
        self.tip_m = np.stack(columns, axis=1)

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


def fit_valves(recording: Recording, nominal: Response) -> ValvesFit:
    """Fit dead time, lag and play of the valves to the pressures sent and measured."""
    finite = np.isfinite(recording.measured_pa).reshape(len(recording.time_s), -1).all(axis=1)
    none = ValvesFit(nominal.delay_s, nominal.lag_s, 0.0, np.zeros(3), "")
    if not finite.all():
        return _refused(none, "the device measured no pressures, without them no lag is seen")
    sent, measured = (
        on_grid(recording.time_s, each)[1] for each in (recording.sent_pa, recording.measured_pa)
    )
    moved_pa = float(np.sqrt(np.mean(np.var(sent, axis=0))))
    if moved_pa < STILL_PA_S:
        return _refused(none, "the pressures hardly changed")

    def rows(x: Array) -> Array:
        played, _ = play_outputs(sent, np.array([[x[2] * 1e3]]))
        return (lagged(played, x[0], x[1]) - measured).reshape(-1) * 1e-3

    starts = [
        np.array([delay_s, lag_s, 0.5])
        for delay_s, lag_s in ((max(nominal.delay_s, 1e-3), max(nominal.lag_s, 1e-3)), (0.01, 0.1))
    ]
    tries = [_solved(rows, start, _VALVES_LOW, _VALVES_HIGH) for start in starts]
    x, sd = min(tries, key=lambda each: float(np.sum(rows(each[0]) ** 2)))
    played, _ = play_outputs(sent, np.array([[x[2] * 1e3]]))
    left = 1e3 * float(np.sqrt(np.mean(rows(x) ** 2))) / moved_pa
    found = ValvesFit(float(x[0]), float(x[1]), 1e3 * float(x[2]), sd, "")
    return _refused(found, _why_no_valves(found, left, _lags(played, measured, float(x[0]))))


def _refused(found: ValvesFit, why: str) -> ValvesFit:
    return ValvesFit(found.delay_s, found.lag_s, found.play_pa, found.sd, why)


def _lags(sent: Array, measured: Array, delay_s: float) -> tuple[float, float]:
    """Lags (s) of filling and of exhausting: of the pressure's rate against what is missing.

    Filling is a rise, or, where there is vacuum, what leads away from ambient: the two of which
    the lags differ more.
    """
    late = lagged(sent, delay_s, 0.0)
    width = max(1, round(0.03 / STEP_S))
    rate = (measured[2 * width :] - measured[: -2 * width]) / (2 * width * STEP_S)
    missing = (late - measured)[width:-width]
    large = np.abs(missing) > 0.1 * np.abs(missing).max(initial=1.0)
    away = missing * np.sign(late[width:-width]) > 0.0
    pairs = [
        (
            _lag(rate[large & way], missing[large & way]),
            _lag(rate[large & ~way], missing[large & ~way]),
        )
        for way in (missing > 0.0, away)
    ]
    return max(pairs, key=lambda lags: max(lags) / max(min(lags), 1e-4))


def _lag(rates: Array, missing: Array) -> float:
    """Lag (s) under which what is missing goes away at these rates."""
    return float(np.sum(missing**2) / max(float(np.sum(missing * rates)), 1e-9))


def _why_no_valves(found: ValvesFit, left: float, lags: tuple[float, float]) -> str:
    filling, exhausting = (1e3 * lag for lag in lags)
    if max(lags) > _LOPSIDED * min(lags) and max(lags) > 0.1:
        return (
            f"the valves fill with a lag of {filling:.0f} ms and exhaust with one of "
            f"{exhausting:.0f} ms, and one lag stands for both"
        )
    if left > _VALVES_LEFT:
        return (
            f"a dead time and a lag leave {100.0 * left:.0f} % of what the pressures moved "
            f"unexplained ({100.0 * _VALVES_LEFT:.0f} % at most)"
        )
    values = np.array([found.delay_s, found.lag_s, 1e-3 * found.play_pa])
    on_bound = _on_bound(values, _VALVES_LOW, _VALVES_HIGH, ("delay_ms", "lag_ms", "the play"))
    if on_bound:
        return on_bound
    if found.delay_s > max(_DELAY_S, _DELAY_SHARE * found.lag_s):
        return (
            f"delay_ms = {1e3 * found.delay_s:.0f} beside lag_ms = {1e3 * found.lag_s:.0f} is no "
            "dead time of a valve"
        )
    return ""


def _on_bound(
    values: Array, low: Sequence[float], high: Sequence[float], names: Sequence[str]
) -> str:
    """Name what ended on a bound that is not 0."""
    for value, least, largest, name in zip(values, low, high, names, strict=True):
        if value > 0.98 * largest or (least > 1e-3 and value < 1.02 * least):
            return f"{name} ended on its bound"
    return ""


def _solved(
    rows: Callable[[Array], Array], start: Array, low: Sequence[float], high: Sequence[float]
) -> tuple[Array, Array]:
    """Least squares within bounds; the solution and its standard deviations."""
    inside = np.clip(start, np.array(low) + 1e-9, np.array(high) - 1e-9)
    found = least_squares(rows, inside, bounds=(low, high), x_scale=np.maximum(inside, 1e-3))
    freedom = max(1, len(found.fun) - len(start))
    variance = 2.0 * found.cost / freedom
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * variance
    return found.x, np.sqrt(np.diag(covariance))


@dataclass(frozen=True)
class _ModeFit:
    """Frequency (Hz) and damping ratio, their deviations, the steps; why they are not taken."""

    values: Array
    sd: Array
    steps: tuple[StepAnswer, ...]
    why_not: str


def _fit_mode(
    grid: _Grid, windows: list[slice], static_m: list[Array], nominal: Response
) -> _ModeFit:
    """Fit the lowest mode to the tip's way after every step."""
    moved = [
        (static @ direction, grid.tip_m[window] @ direction)
        for window, static in zip(windows, static_m, strict=True)
        if np.ptp(static @ (direction := _direction(static))) > _MOVED_M
    ]
    if not moved:
        raise CalibrationError(_NO_STEP)

    def answers(x: Array) -> list[StepAnswer]:
        return [_scaled(_swinging(static, x[0], x[1]), measured) for static, measured in moved]

    def rows(x: Array) -> Array:
        return np.concatenate([1e3 * (a.modelled_m - a.measured_m) for a in answers(x)])

    def cost(x: Array) -> float:
        return float(np.sum(rows(x) ** 2))

    grid_of = [np.array([hz, damping]) for hz in _MODES_HZ for damping in _DAMPINGS]
    near = np.array([nominal.mode_hz, nominal.damping_ratio])
    starts = sorted([near, *grid_of], key=cost)[:3]
    tries = [_solved(rows, start, _MODE_LOW, _MODE_HIGH) for start in starts]
    x, sd = min(tries, key=lambda each: cost(each[0]))
    without = [_scaled(static, measured) for static, measured in moved]
    swing = float(sum(np.sum((a.modelled_m - a.measured_m) ** 2) for a in without)) * 1e6
    left = float(np.sqrt(cost(x) / max(swing, 1e-12)))
    return _ModeFit(x, sd, tuple(answers(x)), _why_no_mode(x, sd, left))


def _scaled(modelled: Array, measured: Array) -> StepAnswer:
    """Answer whose model is shifted and scaled onto the measurement: the map's own error."""
    columns = np.column_stack([modelled, np.ones_like(modelled)])
    gain, offset = np.linalg.lstsq(columns, measured, rcond=None)[0]
    time_s: Array = STEP_S * np.arange(len(measured), dtype=np.float64)
    return StepAnswer(time_s, measured, np.asarray(gain * modelled + offset))


def _why_no_mode(x: Array, sd: Array, left: float) -> str:
    on_bound = _on_bound(x, _MODE_LOW, _MODE_HIGH, ("mode_hz", "damping_ratio"))
    if on_bound:
        return f"{on_bound} at mode_hz = {x[0]:.3g}, damping_ratio = {x[1]:.3g}"
    if left > _MODE_LEFT:
        return (
            f"a mode of {x[0]:.2g} Hz explains too little of how the tip swings after a step: "
            f"{100.0 * left:.0f} % of it is left ({100.0 * _MODE_LEFT:.0f} % at most)"
        )
    if sd[0] > _UNSURE * x[0]:
        return f"mode_hz = {x[0]:.3g} +- {sd[0]:.2g} is not sure enough"
    return ""


def _direction(static_m: Array) -> Array:
    """Direction (3,) in which a step moves the tip most."""
    direction: Array = np.linalg.svd(static_m - static_m.mean(axis=0), full_matrices=False)[2][0]
    return direction


def _swinging(static: Array, mode_hz: float, damping_ratio: float) -> Array:
    """Output of an oscillator that starts at rest, driven by ``static``: bilinear transform."""
    omega = 2.0 * np.pi * mode_hz
    warped = 2.0 * np.tan(min(0.5 * omega * STEP_S, 1.5)) / STEP_S
    k = 2.0 / STEP_S
    over = [
        k**2 + 2.0 * damping_ratio * warped * k + warped**2,
        2.0 * (warped**2 - k**2),
        k**2 - 2.0 * damping_ratio * warped * k + warped**2,
    ]
    under = warped**2 * np.array([1.0, 2.0, 1.0])
    swung: Array = lfilter(under, over, static - static[0]) + static[0]
    return swung

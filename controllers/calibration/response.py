"""How the arm answers: dead time and lags of its valves, frequency and damping of its lowest mode.

The valves are fitted in :mod:`pneuarm.controllers.calibration.valve_fit`. The tip after a step is
where the map says for the pressures measured, through an oscillator of second order; the map's own
error is taken out by an offset and a gain for every step.

Either is taken only where it explains what was measured: a feedback that trusts a mode which was
not seen swings for ever.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from pneuarm.controllers.arm.arm import Arm, Array, Response
from pneuarm.controllers.calibration.frames import Frames
from pneuarm.controllers.calibration.hysteresis import play_outputs
from pneuarm.controllers.calibration.model import TipModel
from pneuarm.controllers.calibration.parameters import start_of
from pneuarm.controllers.calibration.recording import STILL_PA_S, Recording
from pneuarm.controllers.calibration.valve_fit import ValvesFit, fit_valves, on_bound, solved
from pneuarm.controllers.calibration.valves import STEP_S, lagged, on_grid

#: A stretch of motion this near the fastest one of the recording is a step.
_FAST_SHARE = 0.7
#: How long after the beginning of a step the tip is looked at, and the pressures may move (s).
_WINDOW_S, _MOVING_S = 2.0, 0.8
#: A step must move the tip this far (m) to tell a mode from noise.
_MOVED_M = 0.006

_MODE_LOW, _MODE_HIGH = (0.05, 0.005), (50.0, 1.5)
#: Frequencies (Hz) and damping ratios from which the mode is looked for.
_MODES_HZ, _DAMPINGS = np.geomspace(0.3, 15.0, 18), (0.05, 0.2, 0.6)

#: Of how the tip swings about its way, be that a little late (at most so many points of the grid),
#: the mode's model may leave this share.
_MODE_LEFT, _LATEST = 0.4, 8
#: What is damped more does not swing.
_MOST_DAMPED = 0.7
#: A deviation may be this share of its frequency.
_UNSURE = 0.1


@dataclass(frozen=True)
class StepAnswer:
    """One step: time from its beginning (s), the tip measured and modelled along its way, m."""

    time_s: Array
    measured_m: Array
    modelled_m: Array


@dataclass(frozen=True)
class ResponseFit:
    """The response, the standard deviations of its numbers, and the steps behind its mode.

    What was not identified is as it was, with a deviation of 0; ``not_identified`` says what and
    why, one sentence each.
    """

    response: Response
    sd: Response
    steps: tuple[StepAnswer, ...]
    not_identified: tuple[str, ...] = ()


def fit_response(
    arm: Arm, recording: Recording, frames: Frames, valves: ValvesFit | None = None
) -> ResponseFit:
    """Fit the response of ``arm``, whose map and ``frames`` of measurement are fitted already."""
    grid, nominal = _Grid(recording), arm.response
    valves = valves or fit_valves(recording, nominal)
    mode = _mode_of(arm, grid, frames, valves)
    response, sd = nominal, _NO_DEVIATION
    if not valves.why_not:
        delay_s, filling_s, exhausting_s = valves.sd.tolist()
        response = valves.response
        sd = replace(sd, delay_s=delay_s, filling_lag_s=filling_s, exhausting_lag_s=exhausting_s)
    if not mode.why_not:
        response = _swinging_as(response, mode.values)
        sd = _swinging_as(sd, mode.sd)
    reasons = tuple(
        f"{what} not identified: {why}; what was configured of it stays"
        for what, why in (("valve response", valves.why_not), ("mode", mode.why_not))
        if why
    )
    return ResponseFit(response, sd, mode.steps, reasons)


_NO_DEVIATION = Response(
    delay_s=0.0, filling_lag_s=0.0, exhausting_lag_s=0.0, mode_hz=0.0, damping_ratio=0.0
)


def _swinging_as(response: Response, values: Array) -> Response:
    mode_hz, damping_ratio = values.tolist()
    return replace(response, mode_hz=mode_hz, damping_ratio=damping_ratio)


_NO_STEP = (
    "the arm was never moved by a step: pressures must change quickly, the tip by 6 mm or more, "
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


@dataclass(frozen=True)
class _ModeFit:
    """Frequency (Hz) and damping ratio, their deviations, the steps; why they are not taken."""

    values: Array
    sd: Array
    steps: tuple[StepAnswer, ...]
    why_not: str


#: A step: the tip (points,) along its way where the map has it, and measured.
_Moved = tuple[Array, Array]


def _mode_of(arm: Arm, grid: _Grid, frames: Frames, valves: ValvesFit) -> _ModeFit:
    """Fit the lowest mode to the tip's way after every step."""
    # The pressures in the chambers are measured, whatever the valves do; else they are modelled.
    chambers = grid.measured_pa
    if not np.isfinite(chambers).all():
        chambers = lagged(grid.sent_pa, valves.response)
    acting, _ = play_outputs(chambers, arm.per_section("hysteresis_pa"))
    model, start = TipModel(arm), start_of(arm)
    moved = list[_Moved]()
    for window in grid.steps():
        static = frames.measured_m(model.poses(acting[window], start))
        direction = _direction(static)
        if np.ptp(static @ direction) > _MOVED_M:
            moved.append((static @ direction, grid.tip_m[window] @ direction))
    if not moved:
        return _ModeFit(np.zeros(2), np.zeros(2), (), _NO_STEP)
    return _fit_mode(moved, arm.response)


def _fit_mode(moved: list[_Moved], nominal: Response) -> _ModeFit:
    def answers(x: Array) -> list[StepAnswer]:
        return [_scaled(_swinging(static, x[0], x[1]), measured) for static, measured in moved]

    def rows(x: Array) -> Array:
        return _left_mm(answers(x))

    def cost(x: Array) -> float:
        return float(np.sum(rows(x) ** 2))

    grid_of = [np.array([hz, damping]) for hz in _MODES_HZ for damping in _DAMPINGS]
    near = np.array([nominal.mode_hz, nominal.damping_ratio])
    starts = sorted([near, *grid_of], key=cost)[:3]
    tries = [solved(rows, start, _MODE_LOW, _MODE_HIGH) for start in starts]
    x, sd = min(tries, key=lambda each: cost(each[0]))
    left = float(np.sqrt(cost(x) / max(_swing_mm2(moved), 1e-12)))
    return _ModeFit(x, sd, tuple(answers(x)), _why_no_mode(x, sd, left))


def _left_mm(answers: list[StepAnswer]) -> Array:
    return np.concatenate([1e3 * (a.modelled_m - a.measured_m) for a in answers])


def _swing_mm2(moved: list[_Moved]) -> float:
    """Squares of what is left without a mode, the tip being as late as is best.

    A frequency far above all that moved makes the tip late, and nothing else.
    """
    return min(
        float(np.sum(_left_mm([_scaled(_late(way, points), tip) for way, tip in moved]) ** 2))
        for points in range(_LATEST + 1)
    )


def _late(values: Array, points: int) -> Array:
    return np.concatenate([np.repeat(values[:1], points), values[: len(values) - points]])


def _scaled(modelled: Array, measured: Array) -> StepAnswer:
    """Answer whose model is shifted and scaled onto the measurement: the map's own error."""
    columns = np.column_stack([modelled, np.ones_like(modelled)])
    gain, offset = np.linalg.lstsq(columns, measured, rcond=None)[0]
    time_s: Array = STEP_S * np.arange(len(measured), dtype=np.float64)
    return StepAnswer(time_s, measured, np.asarray(gain * modelled + offset))


def _why_no_mode(x: Array, sd: Array, left: float) -> str:
    bound = on_bound(x, _MODE_LOW, _MODE_HIGH, ("mode_hz", "damping_ratio"))
    if bound:
        return f"{bound} at mode_hz = {x[0]:.3g}, damping_ratio = {x[1]:.3g}"
    if x[1] > _MOST_DAMPED:
        return f"what fits best does not swing: mode_hz = {x[0]:.3g}, damping_ratio = {x[1]:.2g}"
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

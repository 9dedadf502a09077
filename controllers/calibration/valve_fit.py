"""Dead time and lags of the valves, fitted to the pressures sent and the pressures measured.

The pressures measured are the pressures sent, through a play, a dead time and a lag of first order
that is another one for filling than for exhausting. Looked at is what follows a fast motion: any
valves follow a slow one. The fit is taken only where it explains what was measured: a lead or a
monitor that trusts a dead time which stands for something else errs with it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from pneuarm.controllers.arm.arm import Array, Response
from pneuarm.controllers.calibration.hysteresis import play_outputs
from pneuarm.controllers.calibration.recording import STILL_PA_S, Recording
from pneuarm.controllers.calibration.valves import STEP_S, lagged, on_grid

#: Bounds of dead time (s), the two lags (s) and the valves' play (kPa).
_LOW, _HIGH = (0.0, 1e-3, 1e-3, 0.0), (0.5, 10.0, 10.0, 20.0)
_NAMES = ("delay_ms", "filling_lag_ms", "exhausting_lag_ms", "the play")
#: Where the fit begins: at the nearest ones of these dead times, lags, and ratios of the two lags.
_DELAYS_S, _LAGS_S, _RATIOS = (0.01, 0.1, 0.25), (0.06, 0.25, 1.0), (0.4, 1.0, 3.0)
_TRIES = 2

#: Pressures that are sent at more than this rate (Pa/s), or at this share of the largest one, are
#: fast; so long (s) after them is looked at.
_FAST_PA_S, _FAST_SHARE, _AFTER_S = 5e4, 0.5, 4.0
#: Of what the pressures move, the model may leave this share.
_LEFT = 0.12
#: Every chamber together must have filled and exhausted by this much (Pa) to show how fast.
_SEEN_PA = 6000.0
#: A deviation may be this share of a dead time or a lag, or this long (s). One that explains
#: nothing may as well be another, and has a large one.
_UNSURE, _UNSURE_S = 0.1, 0.01


@dataclass(frozen=True)
class ValvesFit:
    """``response`` with dead time and lags as fitted, and the width of the valves' loop.

    ``sd`` (3,) are the standard deviations of dead time, filling and exhausting lag, s. ``why_not``
    says why they are not the valves' own, or is empty.
    """

    response: Response
    play_pa: float
    sd: Array
    why_not: str


def fit_valves(recording: Recording, nominal: Response) -> ValvesFit:
    """Fit dead time, lags and play of the valves to the pressures sent and measured."""
    finite = np.isfinite(recording.measured_pa).reshape(len(recording.time_s), -1).all(axis=1)
    none = ValvesFit(nominal, 0.0, np.zeros(3), "")
    if not finite.all():
        return replace(none, why_not="the device measured no pressures, without them none is seen")
    sent, measured = (
        on_grid(recording.time_s, each)[1] for each in (recording.sent_pa, recording.measured_pa)
    )
    seen = _after_fast_motion(sent)
    moved_pa = float(np.sqrt(np.mean(np.var(sent[seen], axis=0)))) if seen.any() else 0.0
    if moved_pa < STILL_PA_S:
        return replace(none, why_not="the pressures hardly changed")

    def rows(x: Array) -> Array:
        played, _ = play_outputs(sent, np.array([[x[3] * 1e3]]))
        return (lagged(played, _with(nominal, x)) - measured)[seen].reshape(-1) * 1e-3

    def cost(x: Array) -> float:
        return float(np.sum(rows(x) ** 2))

    told = (nominal.delay_s, nominal.filling_lag_s, nominal.exhausting_lag_s)
    other = [
        (delay_s, lag_s, ratio * lag_s)
        for delay_s, lag_s, ratio in product(_DELAYS_S, _LAGS_S, _RATIOS)
    ]
    starts = sorted((np.array([*start, 0.5]) for start in [told, *other]), key=cost)[:_TRIES]
    tries = [solved(rows, start, _LOW, _HIGH) for start in starts]
    x, sd = min(tries, key=lambda each: cost(each[0]))
    found = ValvesFit(_with(nominal, x), 1e3 * float(x[3]), sd[:3], "")
    left = 1e3 * float(np.sqrt(np.mean(rows(x) ** 2))) / moved_pa
    played, _ = play_outputs(sent, np.array([[found.play_pa]]))
    ways = np.diff(lagged(played, found.response), axis=0)[seen[1:]]
    return replace(found, why_not=_why_not(x, sd, left, ways))


def _after_fast_motion(sent_pa: Array) -> NDArray[np.bool_]:
    """Points (points,) of the grid that follow soon after a fast motion of any chamber."""
    change = np.abs(np.diff(sent_pa.reshape(len(sent_pa), -1), axis=0)).max(axis=1, initial=0.0)
    least = min(_FAST_PA_S * STEP_S, _FAST_SHARE * float(change.max(initial=0.0)))
    fast = np.append(change > least, False)
    index = np.arange(len(fast))
    newest = np.maximum.accumulate(np.where(fast, index, -len(fast)))
    soon: NDArray[np.bool_] = index - newest < round(_AFTER_S / STEP_S)
    return soon


def _with(nominal: Response, x: Array) -> Response:
    delay_s, filling_lag_s, exhausting_lag_s = x[:3].tolist()
    return replace(
        nominal, delay_s=delay_s, filling_lag_s=filling_lag_s, exhausting_lag_s=exhausting_lag_s
    )


def _why_not(x: Array, sd: Array, left: float, ways: Array) -> str:
    for way, name in ((ways, "filled"), (-ways, "exhausted")):
        if float(np.maximum(way, 0.0).sum()) < _SEEN_PA:
            return f"no chamber was {name} by {1e-5 * _SEEN_PA:.2f} bar or more"
    bound = on_bound(x, _LOW, _HIGH, _NAMES)
    if bound:
        return bound
    if left > _LEFT:
        return (
            f"a dead time and two lags leave {100.0 * left:.0f} % of what the pressures moved "
            f"unexplained ({100.0 * _LEFT:.0f} % at most)"
        )
    for value, deviation, name in zip(x[:3].tolist(), sd[:3].tolist(), _NAMES, strict=False):
        if deviation > max(_UNSURE_S, _UNSURE * value):
            return f"{name} = {1e3 * value:.0f} +- {1e3 * deviation:.0f} is not sure enough"
    return ""


def on_bound(
    values: Array, low: Sequence[float], high: Sequence[float], names: Sequence[str]
) -> str:
    """Name what ended on a bound that is not as good as 0."""
    for value, least, largest, name in zip(values, low, high, names, strict=True):
        if value > 0.98 * largest or (least > 1e-3 and value < 1.02 * least):
            return f"{name} ended on its bound"
    return ""


def solved(
    rows: Callable[[Array], Array], start: Array, low: Sequence[float], high: Sequence[float]
) -> tuple[Array, Array]:
    """Least squares within bounds; the solution and its standard deviations."""
    inside = np.clip(start, np.array(low) + 1e-9, np.array(high) - 1e-9)
    found = least_squares(rows, inside, bounds=(low, high), x_scale=np.maximum(inside, 1e-3))
    freedom = max(1, len(found.fun) - len(start))
    variance = 2.0 * found.cost / freedom
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * variance
    # What nothing depends on has a variance of 0, or of its rounding.
    return found.x, np.sqrt(np.maximum(np.diag(covariance), 0.0))

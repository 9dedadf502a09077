"""How fast an arm may be moved that is watched by somebody who expects other valves than it has.

The monitor of the pressures compares each with the one that it expects by the configured response,
and ends a motion in which they are too far apart. Nobody may tell it to look away. So where the
valves turn out to be others, the arm moves so that a pressure behind them, and one behind those
that are expected, stay near each other:

    ramp of a rate r:     r |T - T'|,             T = dead time + lag, of one and of the other
    step of a size s:     s max_t |a(t) - a'(t)|,   a the answers to a step of 1
"""

from dataclasses import dataclass
from math import inf

import numpy as np

from pneuarm.controllers.arm.arm import Array, Response

#: Of what is allowed, that the difference of two responses may use up; the rest is for noise, the
#: valves' play, and what the responses do not say.
_SHARE = 0.6
#: Answers are compared until so many of the slowest lag have passed.
_LAGS = 5.0


@dataclass(frozen=True)
class Pace:
    """Largest rates (Pa/s) of a ramp up and down, largest step (Pa), slower lag (s) of the valves.

    The default is that of fast valves that everybody knows.
    """

    rising_pa_s: float = inf
    falling_pa_s: float = inf
    step_pa: float = inf
    lag_s: float = 0.0

    def ramp_s(self, change_pa: Array) -> float:
        """Shortest time of an even ramp by such changes (n_sections, 3)."""
        return max(
            float(change_pa.max(initial=0.0)) / self.rising_pa_s,
            float((-change_pa).max(initial=0.0)) / self.falling_pa_s,
        )


def pace_of(expected: Response, found: Response, allowed_pa: float) -> Pace:
    """Pace of an arm with valves as ``found``, whose pressures may be ``allowed_pa`` off."""
    room_pa = _SHARE * allowed_pa
    late = [
        abs(found.delay_s + lag_s - expected.delay_s - expected_s)
        for lag_s, expected_s in _lags(expected, found)
    ]
    apart = max(_apart(expected.delay_s, e, found.delay_s, f) for f, e in _lags(expected, found))
    return Pace(
        rising_pa_s=room_pa / max(late[0], 1e-6),
        falling_pa_s=room_pa / max(late[1], 1e-6),
        step_pa=room_pa / max(apart, 1e-6),
        lag_s=found.slower_lag_s,
    )


def _lags(expected: Response, found: Response) -> list[tuple[float, float]]:
    """Lags found and expected, of filling and of exhausting."""
    return [
        (found.filling_lag_s, expected.filling_lag_s),
        (found.exhausting_lag_s, expected.exhausting_lag_s),
    ]


def _apart(one_delay_s: float, one_s: float, other_delay_s: float, other_s: float) -> float:
    """Largest distance between two answers to a step of 1."""
    end_s = max(one_delay_s, other_delay_s) + _LAGS * max(one_s, other_s)
    time_s = np.linspace(0.0, end_s, 500)
    answers = [
        1.0 - np.exp(-np.maximum(time_s - delay_s, 0.0) / max(lag_s, 1e-4))
        for delay_s, lag_s in ((one_delay_s, one_s), (other_delay_s, other_s))
    ]
    return float(np.abs(answers[0] - answers[1]).max())

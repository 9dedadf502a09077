"""What stands in the place of a closed loop, from what is sent to the tip: mode and dead time."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import bilinear, lfilter, lfiltic

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.learning.course import STEP_S, Course
from pneuarm.controllers.targets.trajectory import TrajectoryTarget

MODE_HZ = 2.2


@dataclass(frozen=True)
class Plant:
    """``gain omega^2 / (s^2 + 2 damping omega s + omega^2) exp(-delay s)`` on every axis."""

    gain: float = 1.0
    mode_hz: float = MODE_HZ
    damping: float = 0.15
    delay_s: float = 0.0

    def tip(self, sent_m: Array, middle_m: Array) -> Array:
        """Tip (n, 3) of what is sent (n, 3), about a place (3,) where the gain changes nothing."""
        omega = 2.0 * np.pi * self.mode_hz
        above, below = self.gain * omega**2, [1.0, 2.0 * self.damping * omega, omega**2]
        b, a = bilinear(above, below, 1.0 / STEP_S)
        times_s = STEP_S * np.arange(len(sent_m))
        columns = []
        for column in (sent_m - middle_m).T:
            late = np.interp(times_s - self.delay_s, times_s, column)
            at_rest = lfiltic(b, a, [self.gain * late[0]] * 2, [late[0]] * 2)
            columns.append(lfilter(b, a, late, zi=at_rest)[0])
        tip: Array = np.stack(columns, axis=1) + middle_m
        return tip

    def at(self, frequency_hz: Array) -> "np.ndarray[tuple[int, ...], np.dtype[np.complex128]]":
        """Its answer at frequencies (n,)."""
        share = frequency_hz / self.mode_hz
        delayed = np.exp(-2j * np.pi * frequency_hz * self.delay_s)
        answer: np.ndarray[tuple[int, ...], np.dtype[np.complex128]]
        answer = self.gain * delayed / (1.0 - share**2 + 2j * self.damping * share)
        return answer


def bow(seconds: float = 6.0, size_m: float = 0.04) -> TrajectoryTarget:
    """A way there and back, with a quicker part aside."""
    times_s = np.linspace(0.0, seconds, 60)
    share = times_s / seconds
    slow, quick = np.sin(np.pi * share) ** 2, np.sin(3.0 * np.pi * share) ** 2
    points = zip(size_m * slow, 0.5 * size_m * quick, 0.2 + 0.0 * share, strict=True)
    return TrajectoryTarget(
        tuple(times_s.tolist()), tuple((float(x), float(y), float(z)) for x, y, z in points)
    )


def bow_course() -> Course:
    return Course(bow())

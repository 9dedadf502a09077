"""Takes out of a correction what would make the body swing at its lowest mode.

A correction that follows the measured tip reaches the arm like any other motion: where it has a
part at the mode, which is hardly damped, the arm answers with a swing that is larger than what was
to be corrected. The inverse of the mode behind two equal poles,

    y = (1 + 2 zeta s / omega + s^2 / omega^2) / (1 + s / omega_c)^2 x

leaves the mode alone and ends where the correction is.
"""

import math

import numpy as np

from pneuarm.controllers.arm.arm import Array, Response

#: The two poles (rad/s): above the mode, so that the correction is hardly late.
_POLES_RAD_S = 25.0


class Notch:
    """A correction (3,) in, the one for the law out, once a tick."""

    def __init__(self, response: Response) -> None:
        omega = 2.0 * math.pi * response.mode_hz
        self._by_velocity, self._by_acceleration = 2.0 * response.damping_ratio / omega, omega**-2
        self.restart(np.zeros(3))

    def restart(self, value: Array) -> None:
        """Take the correction (3,) to have been there for ever."""
        self._position, self._velocity = value, np.zeros(3)

    def step(self, value: Array, dt_s: float) -> Array:
        """Go on by one tick, shorter than 1 / omega_c; return the correction (3,) without the mode.

        What is returned is a new array.
        """
        pole = _POLES_RAD_S
        acceleration = pole * (pole * (value - self._position) - 2.0 * self._velocity)
        self._velocity = self._velocity + dt_s * acceleration
        self._position = self._position + dt_s * self._velocity
        moved: Array = self._position + self._by_velocity * self._velocity
        return moved + self._by_acceleration * acceleration

"""The tip that commanded lengths should give, now and a while ago."""

import math

import numpy as np
from scipy.linalg import expm

from pneuarm.controllers.arm.arm import Arm, Array, Response
from pneuarm.controllers.kinematics.compiled import CompiledKinematics

#: How far back (s) predictions are kept.
HISTORY_S = 0.5


class Prediction:
    """The commanded lengths behind the arm's response, and their tip.

    All lengths go through the valves' lag; what bends a section then goes through the lowest mode,
    what lengthens it does not. The dead time is left to who asks: it is one more age.
    """

    def __init__(self, arm: Arm, period_s: float) -> None:
        self._kinematics = CompiledKinematics(arm)
        self._step, self._input = discrete(arm.response, period_s)
        self._state = np.zeros((3, arm.n_chambers))
        self._shape = (arm.n_sections, 3)
        self._period_s = period_s
        count = math.ceil(HISTORY_S / period_s) + 2
        self._positions, self._rotations = np.zeros((count, 3)), np.zeros((count, 3, 3))
        self._newest = 0
        self.restart(arm.rest_lengths_m)

    def restart(self, lengths_m: Array) -> None:
        """Take the arm to have rested at the lengths (n_sections, 3) for ever."""
        flat = lengths_m.reshape(-1)
        self._state = np.stack([flat, flat, np.zeros_like(flat)])
        tip = self._kinematics.evaluate(lengths_m)
        self._positions[:], self._rotations[:] = tip.position_m, tip.rotation

    def step(self, lengths_m: Array) -> None:
        """Go on by one tick under commanded lengths (n_sections, 3)."""
        state = self._step @ self._state
        state += self._input * lengths_m.reshape(-1)
        self._state = state
        lagged, bent = state[0].reshape(self._shape), state[1].reshape(self._shape)
        along = (lagged - bent).sum(axis=1, keepdims=True) / 3.0
        tip = self._kinematics.evaluate(bent + along)
        self._newest = (self._newest + 1) % len(self._positions)
        self._positions[self._newest] = tip.position_m
        self._rotations[self._newest] = tip.rotation

    def ago(self, age_s: float) -> tuple[Array, Array]:
        """Position (3,) and rotation (3, 3) so long ago, at most HISTORY_S."""
        ticks = min(max(age_s / self._period_s, 0.0), len(self._positions) - 2.0)
        whole = int(ticks)
        share, later = ticks - whole, self._newest - whole
        position = self._positions[later] * (1.0 - share) + self._positions[later - 1] * share
        return position, self._rotations[later]


def discrete(response: Response, period_s: float) -> tuple[Array, Array]:
    """One tick of lag and mode, exact for an input that stays: ``x' = step x + input u``."""
    omega = 2.0 * math.pi * response.mode_hz
    rates = np.zeros((4, 4))
    rates[0, [0, 3]] = -1.0 / response.slower_lag_s, 1.0 / response.slower_lag_s
    rates[1, 2] = 1.0
    rates[2, :3] = omega**2, -(omega**2), -2.0 * response.damping_ratio * omega
    whole = expm(rates * period_s)
    return whole[:3, :3], whole[:3, 3:]

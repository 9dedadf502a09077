"""What is wanted, as one vector of parameters of the compiled step.

Every target writes its part of the vector, and :mod:`pneuarm.controllers.tasks.rows` reads it as
symbols: so one compiled function serves every kind and every combination of them, and nothing is
compiled when a target comes.
"""

from collections.abc import Mapping

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from pneuarm.controllers.arm.arm import Array

#: One radian of orientation error weighs as much as this many metres of position error.
ORIENTATION_LENGTH_M = 0.05

_SIZES = {
    # How fast errors are worked off.
    "gain_per_s": 1,
    "speed_max_m_s": 1,
    # What is measured of the tip beyond the model: p = offset + p(q), R = turn R(q).
    "offset_m": 3,
    "turn": 9,
    # The tip's position; "follows" is 0 where only the velocity is asked for.
    "position_m": 3,
    "position_follows": 1,
    "position_weight": 1,
    "velocity_m_s": 3,
    # The tip's orientation: all of it, or only where it points.
    "rotation": 9,
    "rotation_follows": 1,
    "direction": 3,
    "direction_follows": 1,
    "orientation_weight": 1,
    "angular_rad_s": 3,
    "in_tip_frame": 1,
    "about_base_origin": 1,
    # The chambers, with what is left of the freedoms (posture) or by weight.
    "lengths_weight": 1,
    "posture_weight": 1,
}


def _slices(n_chambers: int, own: Mapping[str, int]) -> dict[str, slice]:
    slices, start = {}, 0
    for name, size in {**_SIZES, **own, "lengths_m": n_chambers}.items():
        slices[name] = slice(start, start + size)
        start += size
    return slices


def symbols(n_chambers: int, own: Mapping[str, int]) -> tuple[ca.SX, Mapping[str, ca.SX]]:
    """Return the whole vector as a symbol, and its parts by name; rotations are (3, 3)."""
    slices = _slices(n_chambers, own)
    whole = ca.SX.sym("wanted", slices["lengths_m"].stop)
    parts = {name: whole[where] for name, where in slices.items()}
    for name in ("rotation", "turn"):  # in C order
        parts[name] = ca.reshape(parts[name], 3, 3).T
    return whole, parts


class Wanted:
    """The vector for one arm; ``values`` keeps its place in memory for the compiled functions.

    ``own`` are the parameters that single kinds of targets have to themselves: name and size.
    """

    def __init__(self, n_chambers: int, own: Mapping[str, int]) -> None:
        slices = _slices(n_chambers, own)
        self.values: Array = np.zeros(slices["lengths_m"].stop)
        self._parts = {name: self.values[where] for name, where in slices.items()}
        self._asked = self.values[slices["position_m"].start :]  # gains and correction lie before
        self._own = tuple(self._parts[name] for name in own)
        self["turn"] = np.eye(3)

    def __setitem__(self, name: str, value: ArrayLike) -> None:
        part = self._parts[name]
        if isinstance(value, np.ndarray) and value.ndim != 1:
            value = value.reshape(-1)
        part[...] = value

    def __getitem__(self, name: str) -> Array:
        return self._parts[name]

    @property
    def beyond_position(self) -> bool:
        """Whether more of the arm is asked for than where its tip or its chambers are."""
        return bool(self["orientation_weight"][0]) or any(part.any() for part in self._own)

    def correct(self, offset_m: Array, turn: Array) -> None:
        """See the tip at ``p(q) + offset_m`` (3,) with the rotation ``turn R(q)``, (3, 3)."""
        self["offset_m"] = offset_m
        self["turn"] = turn

    def forget(self, gain_per_s: float, speed_max_m_s: float) -> None:
        """Ask for nothing; the correction stays."""
        self._asked[...] = 0.0
        self["gain_per_s"], self["speed_max_m_s"] = gain_per_s, speed_max_m_s

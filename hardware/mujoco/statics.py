"""A MuJoCo model at rest: where it hangs, how it swings about that, how stiff it has to be.

Shapes are MuJoCo's ``qpos``, velocities and forces its ``qvel`` and ``qfrc`` (n_dofs,).
"""

from math import pi

import mujoco
import numpy as np
from scipy.linalg import eigh
from scipy.optimize import brentq

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.hardware.simulator.statics import (
    LARGEST_STRAIN,
    beam_stiffness,
    no_stiffness,
    too_soft,
)

#: Newton's method: no coordinate moves further than this in one step (m and rad).
_LARGEST_STEP = 0.2
_NEWTON_STEPS = 60
#: Forces (N and N m) below this share of the arm's largest stiffness are rest.
_REST = 1e-10
#: Half step of the central difference of a force (m and rad).
_DIFFERENCE = 1e-5
#: The stiffness for a mode is looked for within this factor of the guess.
_RANGE = 64.0
_MODE_TOLERANCE = 1e-4


class Statics:
    """A model without contact, asked what force it feels in some shape; ``scale`` stiffens it."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        self._unit = model.jnt_stiffness.copy()
        self._slides = model.jnt_qposadr[model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE]
        is_link = model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE
        self._lengths_m = 2.0 * model.geom_size[is_link, 1]

    def scale(self, factors: Array | float) -> None:
        """Multiply the springs of the model as it was given by factors, (n_joints,) or one."""
        self._model.jnt_stiffness[:] = self._unit * factors

    def rest(self) -> Array:
        """Shape of the unloaded arm at rest under its gravity, found from the straight arm.

        Raises InvalidInput when there is none to be found: the arm is too soft to hold itself.
        """
        shape: Array = self._model.qpos0.copy()
        for _ in range(_NEWTON_STEPS):
            force = self._force(shape)
            if np.abs(force).max() < _REST * self._model.jnt_stiffness.max():
                return shape
            step = np.linalg.solve(self._stiffness(shape), force)
            step *= min(1.0, _LARGEST_STEP / np.abs(step).max())
            mujoco.mj_integratePos(self._model, shape, step, 1.0)
            if np.abs(shape[self._slides] / self._lengths_m).max() > LARGEST_STRAIN:
                break
        raise too_soft()

    def lowest_mode(self, shape: Array) -> tuple[float, Array]:
        """Square of the lowest natural frequency (rad^2/s^2) and its shape, mass-normalised.

        The square is negative where the arm would fall away from the shape.
        """
        stiffness = self._stiffness(shape)
        squares, modes = eigh(stiffness, self._mass(shape), subset_by_index=(0, 0))
        return float(squares[0]), modes[:, 0]

    def scale_for_mode(self, mode_hz: float) -> float:
        """Return the factor with which the lowest mode at rest is ``mode_hz``; leaves it set.

        Raises InvalidInput when no stiffness gives that mode.
        """
        wanted = (2.0 * pi * mode_hz) ** 2

        def excess(log_scale: float) -> float:
            self.scale(float(np.exp(log_scale)))
            try:
                return self.lowest_mode(self.rest())[0] / wanted - 1.0
            except InvalidInput:
                return -1.0

        length = float(self._lengths_m.sum())
        mass = float(self._model.body_mass.sum())
        middle = np.log(beam_stiffness(mass, length, mode_hz))
        low, high = middle - np.log(_RANGE), middle + np.log(_RANGE)
        if excess(low) < 0.0 < excess(high):
            found = float(brentq(excess, low, high, xtol=1e-9, rtol=1e-9))
            if abs(excess(found)) < _MODE_TOLERANCE:
                return float(np.exp(found))
        raise no_stiffness(mode_hz)

    def _force(self, shape: Array) -> Array:
        """Force of springs and gravity in a shape."""
        self._data.qpos[:] = shape
        self._data.qvel[:] = 0.0
        mujoco.mj_fwdPosition(self._model, self._data)
        mujoco.mj_fwdVelocity(self._model, self._data)
        force: Array = self._data.qfrc_passive - self._data.qfrc_bias
        return force

    def _stiffness(self, shape: Array) -> Array:
        """Stiffness of springs and gravity (n_dofs, n_dofs), symmetric."""
        columns = []
        for direction in np.eye(self._model.nv):
            ahead, behind = shape.copy(), shape.copy()
            mujoco.mj_integratePos(self._model, ahead, direction, _DIFFERENCE)
            mujoco.mj_integratePos(self._model, behind, direction, -_DIFFERENCE)
            columns.append((self._force(behind) - self._force(ahead)) / (2.0 * _DIFFERENCE))
        stiffness = np.array(columns)
        return 0.5 * (stiffness + stiffness.T)

    def _mass(self, shape: Array) -> Array:
        """Mass matrix (n_dofs, n_dofs)."""
        self._force(shape)
        mass = np.zeros((self._model.nv, self._model.nv))
        mujoco.mj_fullM(self._model, self._data, mass)
        return mass

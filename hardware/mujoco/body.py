"""The arm's body in MuJoCo, in the place of the simulator's rod: driven by its chambers, stepped.

Pressure acts along the whole chamber, as in the rod; what the body makes of it is MuJoCo's.
"""

from math import ceil

import mujoco
import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array, KeepOut
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.mujoco.model import compiled, force_per_lengthening
from pneuarm.hardware.mujoco.statics import Statics
from pneuarm.hardware.simulator.parameters import DrawnParameters
from pneuarm.hardware.simulator.statics import swing

#: Longest step of MuJoCo. Its springs are explicit and its damping implicit, which is stable for
#: every stiffness while the damping time, here ten times longer, is above half of the step.
_LARGEST_STEP_S = 2e-3

#: An arm that lies on something from the start is given this long to come to rest on it.
_SETTLING_S = 5.0

#: MuJoCo would write them into a file in the folder where the daemon was started: `step` tells.
mujoco.set_mju_user_warning(lambda _: None)


class MujocoBody:
    """A chain of links under gravity, between its arm's keep-outs and other ``obstacles``.

    ``lowest_mode_hz`` is the drawn arm's own, at rest under its gravity and touching nothing.
    Raises InvalidInput for an arm that cannot hold itself.
    """

    def __init__(
        self, arm: Arm, drawn: DrawnParameters, obstacles: tuple[KeepOut, ...] = ()
    ) -> None:
        nominal = Statics(compiled(arm, drawn.nominal, ()))
        bending_n_m2 = nominal.scale_for_mode(drawn.nominal.lowest_mode_hz)
        self._force_per_lengthening = force_per_lengthening(arm, drawn.nominal, bending_n_m2)
        self._model = compiled(arm, drawn.values, arm.keep_outs + obstacles)
        statics = Statics(self._model)
        joints = 2 * drawn.values.segments_per_section + 1
        statics.scale(bending_n_m2 * np.repeat(drawn.stiffness_factors, joints))
        self._rest = statics.rest()
        stiffness = self._model.jnt_stiffness[self._model.dof_jntid]
        self.lowest_mode_hz, damping_time_s = swing(
            *statics.lowest_mode(self._rest), stiffness, drawn.values.damping_ratio
        )
        self._model.dof_damping[:] = damping_time_s * stiffness
        self._data = mujoco.MjData(self._model)
        self.reset()
        self._rest = self._settled()

    def _settled(self) -> Array:
        """Return the shape of rest of the vented arm on whatever it touches."""
        mujoco.mj_forward(self._model, self._data)
        if self._data.ncon:
            self.step(np.zeros(self._force_per_lengthening.shape[1]), _SETTLING_S)
        rest: Array = self._data.qpos.copy()
        return rest

    def reset(self) -> None:
        """Put the arm at rest: vented, hanging as its gravity has it."""
        mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[:] = self._rest

    def step(self, lengthening_m: Array, step_s: float) -> None:
        """Advance by ``step_s`` under lengthenings (n_chambers,) of unloaded chambers.

        Raises HardwareError where MuJoCo's calculation becomes unstable.
        """
        count = max(1, ceil(step_s / _LARGEST_STEP_S - 1e-9))
        self._model.opt.timestep = step_s / count
        self._data.qfrc_applied[:] = self._force_per_lengthening @ lengthening_m
        mujoco.mj_step(self._model, self._data, count)
        if self._data.warning.number.any():
            raise HardwareError(
                "MuJoCo's calculation of the arm became unstable, and where the arm is is lost: "
                "start again, without mujoco.obstacles if it comes back"
            )

    def tip(self) -> tuple[Array, Array]:
        """Tip position (3,) in m and rotation (3, 3), in the base frame; copies."""
        mujoco.mj_kinematics(self._model, self._data)
        plate = self._model.nbody - 1
        return self._data.xpos[plate].copy(), self._data.xmat[plate].reshape(3, 3).copy()

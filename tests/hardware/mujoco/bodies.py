"""Arms with a body in MuJoCo, nominal or drawn."""

from dataclasses import replace

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.hardware.mujoco.body import MujocoBody
from pneuarm.hardware.simulator.parameters import DrawnParameters, SimulatorParameters
from pneuarm.service.configuration.configuration import load

NOMINAL = SimulatorParameters(segments_per_section=10)
ARMS = {name: load(preset=name).build_arm() for name in ("paper", "table1", "trunk")}
PAPER = ARMS["paper"]

GRAVITIES = {
    "hanging": (0.0, 0.0, 9.81),
    "weightless": (0.0, 0.0, 0.0),
    "sideways": (9.81, 0.0, 0.0),
    "standing": (0.0, 0.0, -9.81),
}


def under(gravity: str, arm: Arm = PAPER) -> Arm:
    """Return the arm under another gravity."""
    return replace(arm, gravity_m_s2=GRAVITIES[gravity])


def nominal(arm: Arm) -> DrawnParameters:
    """Every factor at 1."""
    return DrawnParameters(0, NOMINAL, NOMINAL, (1.0,) * arm.n_sections)


def nominal_body(arm: Arm) -> MujocoBody:
    """Return the nominal body of an arm."""
    return MujocoBody(arm, nominal(arm))


def settle(body: MujocoBody, lengthening_m: Array, duration_s: float = 6.0) -> tuple[Array, Array]:
    """Tip position and rotation after holding the lengthenings."""
    body.step(np.reshape(lengthening_m, -1), duration_s)
    return body.tip()

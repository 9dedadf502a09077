"""The simulated arm as a kind of device."""

from dataclasses import replace
from typing import Annotated

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm, uncalibrated
from pneuarm.hardware.device import Address, Device, InMemory
from pneuarm.hardware.interface import Hardware
from pneuarm.hardware.simulator.parameters import NOMINAL, Valves, draw
from pneuarm.hardware.tables.arm import ArmConfig
from pneuarm.hardware.tables.table import Table


class SimulatorConfig(Table):
    """The simulated arm: every parameter is drawn from the seed.

    It stands behind every emulated device too.
    """

    seed: Annotated[
        int,
        Field(
            ge=0, lt=2**32, description="which arm of the family; see [simulator.md](simulator.md)"
        ),
    ] = 0
    valves: Annotated[
        Valves,
        Field(
            description="`servo`: fast, and alike in both directions; `itv`: regulators, as slow "
            "and lopsided as SMC ITV ones in public logs; `onoff`: switched valves; see "
            "[simulator.md](simulator.md#valves)"
        ),
    ] = "servo"
    arm: Annotated[
        ArmConfig | None,
        Field(
            description="the arm that is simulated, where it is not `[arm]`: a calibration of a "
            "simulated arm changes what the controller believes, not the arm. Its coupling, "
            "hysteresis and compliances are not used: the simulated body has its own"
        ),
    ] = None


def simulated_arm(config: SimulatorConfig, arm: Arm) -> Arm:
    """Return the arm that is made real: ``arm`` where the configuration names no other.

    Its body has weight, stiffness and hysteresis of its own: those of a calibration are left out.
    """
    body = arm if config.arm is None else config.arm.build()
    return replace(body, sections=tuple(uncalibrated(section) for section in body.sections))


def drawn_parameters(config: SimulatorConfig, arm: Arm) -> dict[str, float]:
    """Return the seed and every parameter that is drawn from it, to repeat a run."""
    drawn = draw(NOMINAL[config.valves], config.seed, arm.n_sections).as_dict()
    del drawn["lowest_mode_hz"]  # follows from the others, and is known once the rod is built
    return drawn


class Simulator(Device[SimulatorConfig]):
    """An arm of air and mass in this machine's memory."""

    name = "simulator"
    summary = "the simulated arm"
    config = SimulatorConfig
    never_waits = True

    def build(self, config: SimulatorConfig, arm: Arm) -> Hardware:
        """Make the arm of the seed."""
        from pneuarm.hardware.simulator.adapter import SimulatedArm

        return SimulatedArm(simulated_arm(config, arm), NOMINAL[config.valves], config.seed)

    def address(self, config: SimulatorConfig) -> Address:
        """Return that each daemon makes its own."""
        return InMemory()

    def left_behind(self, config: SimulatorConfig) -> str:
        """Nothing: when its host ends, its air is gone."""
        return ""


DEVICE = Simulator()

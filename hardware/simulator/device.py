"""The simulated arm as a kind of device, and what every arm that is calculated here has."""

from abc import abstractmethod
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, TypeVar

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm, uncalibrated
from pneuarm.hardware.device import Address, Device, InMemory
from pneuarm.hardware.interface import Hardware
from pneuarm.hardware.simulator.parameters import NOMINAL, SimulatorParameters, Valves, draw
from pneuarm.hardware.tables.arm import ArmConfig
from pneuarm.hardware.tables.table import Table

if TYPE_CHECKING:
    from pneuarm.hardware.simulator.adapter import MakeBody


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


Config = TypeVar("Config", bound=SimulatorConfig)


class SimulatedDevice(Device[Config]):
    """An arm in this machine's memory: it never waits, and its true tip is known."""

    never_waits = True

    def nominal(self, config: Config) -> SimulatorParameters:
        """Return the nominal arm of the family, from which the seed draws."""
        return NOMINAL[config.valves]

    @abstractmethod
    def body(self, config: Config) -> "MakeBody":
        """Return what makes the body that valves and chambers move."""

    def build(self, config: Config, arm: Arm) -> Hardware:
        """Make the arm of the seed."""
        from pneuarm.hardware.simulator.adapter import SimulatedArm

        body = self.body(config)
        return SimulatedArm(simulated_arm(config, arm), self.nominal(config), config.seed, body)

    def drawn_parameters(self, config: Config, arm: Arm) -> dict[str, float]:
        """Return the seed and every parameter that is drawn from it, to repeat a run."""
        drawn = draw(self.nominal(config), config.seed, arm.n_sections).as_dict()
        del drawn["lowest_mode_hz"]  # follows from the others, and is known once the body is built
        return drawn

    def address(self, config: Config) -> Address:
        """Return that each daemon makes its own."""
        return InMemory()

    def left_behind(self, config: Config) -> str:
        """Nothing: when its host ends, its air is gone."""
        return ""


class Simulator(SimulatedDevice[SimulatorConfig]):
    """The arm whose body is a lumped rod of this project's own."""

    name = "simulator"
    summary = "the simulated arm"
    config = SimulatorConfig

    def body(self, config: SimulatorConfig) -> "MakeBody":
        """Return the rod."""
        from pneuarm.hardware.simulator.rod import Rod

        return Rod


DEVICE = Simulator()

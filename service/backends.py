"""Adapter's name -> device, loaded only when it is asked for."""

from controllers.arm import Arm
from hardware.interface import Hardware
from service.config import Configuration


def build(configuration: Configuration, arm: Arm) -> Hardware:
    """Make the device that the configuration names; it is not connected yet."""
    from hardware.simulator.adapter import SimulatedArm
    from hardware.simulator.parameters import SimulatorParameters

    simulated = configuration.build_simulated_arm()
    return SimulatedArm(simulated, SimulatorParameters(), configuration.simulator.seed)


def drawn_parameters(configuration: Configuration, arm: Arm) -> dict[str, float]:
    """Every parameter that the simulator draws from its seed, to repeat the run."""
    from hardware.simulator.parameters import SimulatorParameters, draw

    drawn = draw(SimulatorParameters(), configuration.simulator.seed, arm.n_sections).as_dict()
    del drawn["lowest_mode_hz"]  # follows from the others, and is known once the rod is built
    return drawn

"""The simulated arm with a body in MuJoCo, as a kind of device."""

from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from pneuarm.controllers.arm.errors import NotInstalled
from pneuarm.hardware.simulator.device import SimulatedDevice, SimulatorConfig
from pneuarm.hardware.simulator.parameters import SimulatorParameters
from pneuarm.hardware.tables.arm import KeepOutConfig

if TYPE_CHECKING:
    from pneuarm.hardware.simulator.adapter import MakeBody


class MujocoConfig(SimulatorConfig):
    """The simulated arm with a body in MuJoCo: the same valves, chambers and sensors.

    See [simulator.md](simulator.md#the-same-arm-in-mujoco).
    """

    segments_per_section: Annotated[
        int,
        Field(
            ge=2,
            le=40,
            multiple_of=2,
            description="stiff links a section, an even number, between springs",
        ),
    ] = 10
    obstacles: Annotated[
        tuple[KeepOutConfig, ...],
        Field(
            max_length=16,
            strict=False,
            description="what is in the arm's way and the controller does not know of, a floor for "
            "example; `arm.keep_outs` are solid too",
        ),
    ] = ()


class Mujoco(SimulatedDevice[MujocoConfig]):
    """The arm whose body is MuJoCo's: it twists, and touches what is in its way."""

    name = "mujoco"
    summary = "the simulated arm in MuJoCo"
    config = MujocoConfig

    def require(self) -> None:
        """Raise NotInstalled without MuJoCo."""
        if find_spec("mujoco") is None:
            raise NotInstalled(
                'hardware.adapter = "mujoco" needs MuJoCo, which is not installed: '
                'pip install "pneuarm[mujoco]"'
            )

    def nominal(self, config: MujocoConfig) -> SimulatorParameters:
        """Return the simulator's, in as many links as configured."""
        links = config.segments_per_section
        return replace(super().nominal(config), segments_per_section=links)

    def body(self, config: MujocoConfig) -> "MakeBody":
        """Return MuJoCo's."""
        from pneuarm.hardware.mujoco.body import MujocoBody

        obstacles = tuple(place.keep_out() for place in config.obstacles)
        return partial(MujocoBody, obstacles=obstacles)


DEVICE = Mujoco()

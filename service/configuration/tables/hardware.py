"""The device that moves the air."""

from math import inf
from typing import Annotated, Literal

from pydantic import Field

from pneuarm.service.configuration.tables.arm import ArmConfig
from pneuarm.service.configuration.tables.table import BAR, Table


class HardwareConfig(Table):
    """The device that moves the air. ``device`` empty means one simulator an arm.

    ``supply_flow_max_bar_s`` 0 means a supply without limit.
    """

    adapter: Literal["simulator", "festo-cpx", "festo-vtem", "ctrl-p", "esp32", "replay"] = (
        "simulator"
    )
    device: Annotated[str, Field(max_length=64, pattern=r"^[\x20-\x7e]*$")] = ""
    exchange_rate_hz: Annotated[float, Field(ge=10, le=1000)] = 200.0
    accept_no_watchdog: bool = False
    supply_flow_max_bar_s: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0

    @property
    def supply_flow_limit_pa_s(self) -> float:
        """The sum of all rises that the supply can feed, in SI units."""
        return self.supply_flow_max_bar_s * BAR or inf


class SimulatorConfig(Table):
    """The simulated arm: every parameter is drawn from the seed.

    ``arm`` is the arm that is simulated where it is not the one that the controller believes in:
    a calibration changes the second, not the first.
    """

    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    arm: ArmConfig | None = None

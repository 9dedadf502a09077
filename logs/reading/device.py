"""A recorded session as a kind of device."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.device import Address, Device, InMemory
from pneuarm.hardware.interface import Hardware
from pneuarm.hardware.tables.table import PathText, Table


class ReplayConfig(Table):
    """A recorded session in the place of a device.

    See [hardware.md](hardware.md#a-recorded-log-in-the-place-of-a-device).
    """

    log: Annotated[
        PathText,
        Field(description="path of the session, its first part, `~` is understood; must be given"),
    ] = ""


class Replay(Device[ReplayConfig]):
    """What was measured is measured again; commands go nowhere."""

    name = "replay"
    summary = "a recorded session"
    config = ReplayConfig

    def build(self, config: ReplayConfig, arm: Arm) -> Hardware:
        """Open the log; raises ConfigurationError where there is none, or one of another arm."""
        if not config.log:
            raise ConfigurationError(
                'replay.log is missing: the path of a recorded session, ".mcap"'
            )
        from pneuarm.logs.reading.replay_device import ReplayDevice

        return ReplayDevice(arm, Path(config.log).expanduser())

    def address(self, config: ReplayConfig) -> Address:
        """Return that each daemon reads for itself."""
        return InMemory()

    def left_behind(self, config: ReplayConfig) -> str:
        """Nothing: there is no air behind it."""
        return ""


DEVICE = Replay()

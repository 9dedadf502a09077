"""The public names of pneuarm, for a user's own program.

    from pneuarm import Client

    with Client("paper") as arm:
        arm.enable()
        arm.move_to((0.04, 0.0, 0.2))

Everything else is imported by its room: ``pneuarm.controllers``, ``pneuarm.hardware``,
``pneuarm.logs``, ``pneuarm.service``. `python -m pneuarm` is the command line.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pneuarm.controllers.arm.errors import (
        AlreadyInUse,
        CalibrationError,
        ConfigurationError,
        DaemonUnreachable,
        HardwareError,
        InvalidInput,
        LearningDiverges,
        LearningError,
        LeaseRefused,
        LogError,
        MessageRejected,
        ModeRefused,
        MoveTimeout,
        NotConfirmed,
        NotInstalled,
        OutOfReach,
        PneuarmError,
        TargetRejected,
        TrialLost,
    )
    from pneuarm.service.client.client import Client

__version__ = "0.1.0"

__all__ = [
    "AlreadyInUse",
    "CalibrationError",
    "Client",
    "ConfigurationError",
    "DaemonUnreachable",
    "HardwareError",
    "InvalidInput",
    "LearningDiverges",
    "LearningError",
    "LeaseRefused",
    "LogError",
    "MessageRejected",
    "ModeRefused",
    "MoveTimeout",
    "NotConfirmed",
    "NotInstalled",
    "OutOfReach",
    "PneuarmError",
    "TargetRejected",
    "TrialLost",
    "__version__",
]


def __getattr__(name: str) -> object:
    """Load a public name when it is first asked for: the command line needs none of them."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = "service.client.client" if name == "Client" else "controllers.arm.errors"
    value: object = getattr(import_module(f"pneuarm.{home}"), name)
    globals()[name] = value
    return value

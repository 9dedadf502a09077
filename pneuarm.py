"""The public names of pneuarm, for a user's own program.

    from pneuarm import Client

    with Client("paper") as arm:
        arm.enable()
        arm.move_to((0.04, 0.0, 0.2))

`python -m pneuarm` is the command line.
"""

import os
import signal
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from controllers.errors import (
        DaemonUnreachable,
        LeaseRefused,
        ModeRefused,
        NotConfirmed,
        PneuarmError,
        TargetRejected,
    )
    from service.client import Client

__all__ = [
    "Client",
    "DaemonUnreachable",
    "LeaseRefused",
    "ModeRefused",
    "NotConfirmed",
    "PneuarmError",
    "TargetRejected",
]

_HERE = Path(__file__).resolve().parent


def _check_own_packages() -> None:
    """Raise ImportError where a module of the user's own hides one of ours."""
    for name in ("controllers", "hardware", "logs", "service"):
        spec = find_spec(name)
        found = "nothing" if spec is None else str(spec.origin or spec.submodule_search_locations)
        if spec is None or not Path(found).resolve().is_relative_to(_HERE / name):
            raise ImportError(
                f"pneuarm needs its own package {name!r} from {_HERE}, but found {found}: rename "
                "that module, or run from another folder"
            )


_check_own_packages()


def __getattr__(name: str) -> object:
    """Load a public name when it is first asked for: the command line needs none of them."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = import_module("service.client" if name == "Client" else "controllers.errors")
    value: object = getattr(module, name)
    globals()[name] = value
    return value


def _on_ctrl_c(number: int, frame: FrameType | None) -> None:
    """End without a word while a command still loads; nothing has begun yet."""
    loading = None
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            loading = frame.f_back  # in the end: who began to load
        frame = frame.f_back
    if loading is not None and loading.f_globals.get("__name__") in (__name__, "service.cli"):
        os._exit(130)
    raise KeyboardInterrupt


def main() -> None:
    """Run the command line."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not so under `nohup`
        signal.signal(signal.SIGINT, _on_ctrl_c)
    from service.cli import main as command

    raise SystemExit(command())


if __name__ == "__main__":
    main()

"""The public names of pneuarm, for a user's own program.

    from pneuarm import Client

    with Client("paper") as arm:
        arm.enable()
        arm.move_to((0.04, 0.0, 0.2))

`python -m pneuarm` is the command line.
"""

from importlib.util import find_spec
from pathlib import Path

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

from controllers.errors import (  # noqa: E402
    DaemonUnreachable,
    LeaseRefused,
    ModeRefused,
    NotConfirmed,
    PneuarmError,
    TargetRejected,
)
from service.client import Client  # noqa: E402

__all__ = [
    "Client",
    "DaemonUnreachable",
    "LeaseRefused",
    "ModeRefused",
    "NotConfirmed",
    "PneuarmError",
    "TargetRejected",
]


def main() -> None:
    """Run the command line."""
    from service.cli import main as command

    raise SystemExit(command())


if __name__ == "__main__":
    main()

"""`pneuarm estop`. It stops past the network first, and loads Zenoh only where that is no way."""

import argparse
import json
from collections.abc import Callable

from pneuarm.controllers.arm.errors import NotConfirmed
from pneuarm.service.daemon.local_stop import stop_locally
from pneuarm.service.processes.last_resort import sentence


def estop(arguments: argparse.Namespace) -> int:
    """Stop by every way there is until one is confirmed; raises NotConfirmed."""
    ways: tuple[tuple[str, Callable[[], None]], ...] = (
        ("on this machine", lambda: stop_locally(arguments.arm)),
        (f"through {arguments.connect}", lambda: _stop_through_the_network(arguments)),
    )
    failures = []
    for way, stop in ways:
        try:
            stop()
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # whatever it is, the next way is tried
            failures.append(error.why if isinstance(error, NotConfirmed) else sentence(error))
        else:
            _tell(arguments, way)
            return 0
    raise NotConfirmed("; ".join(failures))


def _stop_through_the_network(arguments: argparse.Namespace) -> None:
    from pneuarm.service.client.client import Client

    with Client(arguments.arm, arguments.connect, "pneuarm", arguments.zenoh_config) as client:
        client.estop()


def _tell(arguments: argparse.Namespace, way: str) -> None:
    text = f"STOPPED: arm {arguments.arm} vents, confirmed {way}; `pneuarm reset` leaves the stop"
    print(json.dumps({"stopped": True, "confirmed": way}) if arguments.json else text)

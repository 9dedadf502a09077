"""`pneuarm estop`: past the network first, then through it; whatever fails, it is told.

Zenoh is loaded in a process of its own: what ends that one, a machine without memory too, does not
keep this one from saying NOT CONFIRMED.
"""

import argparse
import json
import os
import select
import signal
from collections.abc import Callable

from pneuarm.controllers.arm.errors import NotConfirmed
from pneuarm.service.daemon.local_stop import stop_locally
from pneuarm.service.processes.last_resort import sentence

#: What the process through the network says of a stop that was confirmed, and how long it may take.
_DONE = b"stopped"
_PATIENCE_S = 20.0
_MOST_BYTES = 4096


def estop(arguments: argparse.Namespace) -> int:
    """Stop by every way there is until one is confirmed; raises NotConfirmed."""
    ways: tuple[tuple[str, Callable[[], None]], ...] = (
        ("on this machine", lambda: stop_locally(arguments.arm)),
        (f"through {arguments.connect}", lambda: _apart(lambda: _through_the_network(arguments))),
    )
    failures: list[str] = []
    for way, stop in ways:
        try:
            stop()
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # whatever it is, the next way is tried
            failures.append(_why(error))
        else:
            _tell(arguments, way)
            return 0
    raise NotConfirmed("; ".join(failures))


def _why(error: BaseException) -> str:
    return error.why if isinstance(error, NotConfirmed) else sentence(error)


def _apart(stop: Callable[[], None]) -> None:
    """Call it in a forked process; raises NotConfirmed with what was raised there."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.write(writing, _outcome(stop))
        finally:
            os._exit(0)
    os.close(writing)
    try:
        ready = select.select([reading], [], [], _PATIENCE_S)[0]
        told = os.read(reading, _MOST_BYTES) if ready else b""
    finally:
        os.close(reading)
        os.kill(child, signal.SIGKILL)  # it has said what it had to say
        os.waitpid(child, 0)
    if told != _DONE:
        nothing = "its process ended" if ready else f"no answer within {_PATIENCE_S:g} s"
        raise NotConfirmed(told.decode() or f"nothing was heard through the network: {nothing}")


def _outcome(stop: Callable[[], None]) -> bytes:
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # a panic of Zenoh's is a page of text
        stop()
    except BaseException as error:
        return _why(error).encode(errors="backslashreplace")[:_MOST_BYTES]
    return _DONE


def _through_the_network(arguments: argparse.Namespace) -> None:
    from pneuarm.service.client.client import Client

    with Client(arguments.arm, arguments.connect, "pneuarm", arguments.zenoh_config) as client:
        client.estop()


def _tell(arguments: argparse.Namespace, way: str) -> None:
    text = f"STOPPED: arm {arguments.arm} vents, confirmed {way}; `pneuarm reset` leaves the stop"
    print(json.dumps({"stopped": True, "confirmed": way}) if arguments.json else text)

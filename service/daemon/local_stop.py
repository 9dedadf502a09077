"""The lock on a device and on an arm's name, and the stop that needs no network.

Both are abstract Unix sockets: the kernel frees them with the last process that holds them,
however it ends, and they leave no file behind. Whoever connects to the arm's socket and sends
``estop`` stops the arm, and is told whether it acted.
"""

import contextlib
import socket
import struct

from pneuarm.controllers.arm.errors import AlreadyInUse, DaemonUnreachable, NotConfirmed

_CONFIRM_S = 1.0


def _address(kind: str, name: str) -> str:
    return f"\0pneuarm/{kind}/{name}"


def lock(kind: str, name: str) -> socket.socket:
    """Take the lock on a device or an arm; raises AlreadyInUse if another daemon has it."""
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_CLOEXEC)
    try:
        listener.bind(_address(kind, name))
    except OSError as error:
        listener.close()
        process_id = _holder(kind, name)
        who = f" (process {process_id})" if process_id is not None else ""
        raise AlreadyInUse(
            f"{kind} {name!r} is in use by another pneuarm daemon{who}; stop that one first, or "
            f"name another {kind}",
            process_id,
        ) from error
    listener.listen(8)
    return listener


def _holder(kind: str, name: str) -> int | None:
    """Process number of who holds a lock, as far as the kernel tells."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe, contextlib.suppress(OSError):
        probe.settimeout(0.2)
        probe.connect(_address(kind, name))
        credentials = probe.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12)
        return int(struct.unpack("3i", credentials)[0])
    return None


def stop_locally(arm_name: str) -> None:
    """Stop an arm whose daemon runs on this machine, past the network.

    Raises DaemonUnreachable if there is none here, NotConfirmed if it did not say that it acted.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.settimeout(_CONFIRM_S)
        try:
            connection.connect(_address("arm", arm_name))
            connection.sendall(b"estop\n")
            answer = connection.recv(64)
        except ConnectionRefusedError as error:
            raise DaemonUnreachable(
                f"no daemon for arm {arm_name!r} runs on this machine"
            ) from error
        except OSError:  # it is there, and stuck
            answer = b""
    if answer != b"stopped\n":
        raise NotConfirmed(
            f"NOT CONFIRMED: the daemon of arm {arm_name!r} did not say that it stopped; cut the "
            "air supply"
        )

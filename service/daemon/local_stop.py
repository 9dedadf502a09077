"""The stop that needs no network: an abstract Unix socket of the arm's name.

The kernel frees it with the supervisor, however that ends, and it leaves no file behind. Whoever
connects to it and sends ``estop`` stops the arm, and is told whether it acted. Nothing is loaded
here that a stop could fail at.
"""

import contextlib
import socket
import struct
import time
from collections.abc import Sequence

from pneuarm.controllers.arm.errors import AlreadyInUse, DaemonUnreachable, NotConfirmed

_CONFIRM_S = 1.0

#: Who connects and says nothing is forgotten after so long, or when so many have come after it.
_SILENT_S = 1.0
_MOST_CALLERS = 128


def _address(arm_name: str) -> str:
    return f"\0pneuarm/arm/{arm_name}"


def listen(arm_name: str) -> socket.socket:
    """Listen for stops of an arm; raises AlreadyInUse where somebody does so already."""
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_CLOEXEC)
    try:
        listener.bind(_address(arm_name))
        listener.listen(_MOST_CALLERS)
    except OSError as error:
        listener.close()
        raise AlreadyInUse(
            f"the stop of arm {arm_name!r} on this machine cannot be listened for "
            f"({error.strerror}): another program has its address; end that one first"
        ) from error
    return listener


class Callers:
    """The supervisor's end of an arm's socket: who speaks is heard, who is silent delays nobody."""

    def __init__(self, listener: socket.socket) -> None:
        self._listener = listener
        listener.setblocking(False)
        self._silent: dict[socket.socket, float] = {}  # since when, oldest first

    def sockets(self) -> list[socket.socket]:
        """What is to be watched for something to read."""
        return [self._listener, *self._silent]

    def asking_to_stop(self, readable: Sequence[object]) -> list[socket.socket]:
        """Return the connections that now ask to stop; each is to be answered and closed."""
        if self._listener in readable:
            self._accept()
        self._forget()
        return [caller for caller in list(self._silent) if self._asks_to_stop(caller)]

    def _accept(self) -> None:
        with contextlib.suppress(OSError):  # nobody is left, or there is no descriptor for it
            for _ in range(_MOST_CALLERS):
                caller, _ = self._listener.accept()
                caller.setblocking(False)
                self._silent[caller] = time.monotonic()

    def _forget(self) -> None:
        now_s, surplus = time.monotonic(), len(self._silent) - _MOST_CALLERS
        for number, (caller, since_s) in enumerate(list(self._silent.items())):
            if (number < surplus or now_s - since_s > _SILENT_S) and not self._speaks(caller):
                self._end(caller)

    @staticmethod
    def _speaks(caller: socket.socket) -> bool:
        try:
            return bool(caller.recv(1, socket.MSG_PEEK))
        except OSError:
            return False

    def _asks_to_stop(self, caller: socket.socket) -> bool:
        try:
            asked = caller.recv(16)
        except BlockingIOError:
            return False  # silent as yet
        except OSError:
            asked = b""
        if not asked.startswith(b"estop"):
            self._end(caller)
            return False
        del self._silent[caller]
        return True

    def _end(self, caller: socket.socket) -> None:
        del self._silent[caller]
        caller.close()


def stop_locally(arm_name: str) -> None:
    """Stop an arm whose daemon runs on this machine, past the network.

    Raises DaemonUnreachable if there is none here, NotConfirmed if it did not say that it acted.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        # Not `settimeout`: where the queue of callers is full, that gives up without waiting.
        patience = struct.pack("ll", int(_CONFIRM_S), int(1e6 * (_CONFIRM_S % 1.0)))
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, patience)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, patience)
        try:
            connection.connect(_address(arm_name))
            connection.sendall(b"estop\n")
            answer = connection.recv(64)
        except ConnectionRefusedError as error:
            raise DaemonUnreachable(
                f"no daemon for arm {arm_name!r} runs on this machine"
            ) from error
        except OSError:  # it is there, and stuck
            answer = b""
    if answer != b"stopped\n":
        raise NotConfirmed(f"the daemon of arm {arm_name!r} did not say that it stopped")

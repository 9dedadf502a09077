"""What goes through the command pipe between gateway, supervisor and control.

Every message is one datagram, so neither side ever waits for the rest of one.
"""

import pickle
import socket
from dataclasses import dataclass

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.targets.targets import Target
from pneuarm.service.modes.mode import Mode, ModeEvent

_LARGEST = 65536


@dataclass(frozen=True)
class SetTarget:
    """A checked target; ``received_ns`` is the monotonic time of its receipt."""

    target: Target
    sequence: int
    received_ns: int


@dataclass(frozen=True)
class RequestMode:
    """An event for the mode machine; ``client`` is who asked, for the log."""

    event: ModeEvent
    request_id: int
    client: str


@dataclass(frozen=True)
class SetTipPose:
    """A measured tip pose in the base frame: position (3,) m and quaternion (4,)."""

    position_m: Array
    quaternion_xyzw: Array
    received_ns: int


@dataclass(frozen=True)
class Heartbeat:
    """The gateway is alive; ``operator`` says whether somebody holds the lease."""

    operator: bool


@dataclass(frozen=True)
class Shutdown:
    """From the supervisor: vent and end."""


Command = SetTarget | RequestMode | SetTipPose | Heartbeat | Shutdown


@dataclass(frozen=True)
class ModeReply:
    """What became of a RequestMode."""

    request_id: int
    accepted: bool
    reason: str
    mode: Mode
    sequence: int


class Pipe:
    """One end of a non-blocking pipe of messages; handed to a child process as an argument."""

    def __init__(self, end: socket.socket) -> None:
        self._socket = end
        self._socket.setblocking(False)
        self.dropped = 0
        self.closed = False

    def __setstate__(self, state: dict[str, object]) -> None:
        """Arrive in a child process: the new socket object must not block either."""
        self.__dict__.update(state)
        self._socket.setblocking(False)

    def send(self, message: Command | ModeReply) -> bool:
        """Send without waiting; returns False, and counts, if the other side does not read.

        What is longer than one datagram may be is not sent either: it would arrive cut off.
        """
        data = pickle.dumps(message)
        if len(data) > _LARGEST:
            self.dropped += 1
            return False
        try:
            self._socket.send(data)
        except OSError:
            self.dropped += 1
            return False
        return True

    def receive(self) -> Command | ModeReply | None:
        """Return the next message or None. ``closed`` turns True when the other side is gone."""
        try:
            data = self._socket.recv(_LARGEST)
        except BlockingIOError:
            return None
        except OSError:
            data = b""
        if not data:
            self.closed = True
            return None
        message: Command | ModeReply = pickle.loads(data)
        return message

    def fileno(self) -> int:
        """File descriptor, for select."""
        return self._socket.fileno()

    def close(self) -> None:
        """Close this end."""
        self._socket.close()


def new_pipe() -> tuple[Pipe, Pipe]:
    """Two connected ends."""
    one, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    return Pipe(one), Pipe(other)

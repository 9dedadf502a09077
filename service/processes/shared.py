"""What every child process of the daemon does first, and what is handed to it."""

import os
import signal
import threading
import time
from dataclasses import dataclass
from multiprocessing import parent_process

from pneuarm.logs.rings.rings import Rings
from pneuarm.logs.rings.status import RecorderStatus, ViewerStatus
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.processes.device_slots import DeviceLink
from pneuarm.service.processes.usage import ProcessTable

#: Codes of what control says of its start; the supervisor passes it on in its own words.
REALTIME, START_FAILED = "realtime", "start_failed"

#: Ctrl-C, the order to end, and a terminal that was closed.
ENDING_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@dataclass(frozen=True)
class Shared:
    """What all processes of one daemon have in common; made by the supervisor."""

    configuration: Configuration
    info: pb.Info
    session: str
    start_ns: int
    start_unix_ns: int
    rings: Rings
    recorder: RecorderStatus
    viewer: ViewerStatus
    processes: ProcessTable
    device: DeviceLink | None = None

    def unix_ns(self, monotonic_ns: int) -> int:
        """UTC of a monotonic time: UTC once at the start, plus monotonic time since."""
        return self.start_unix_ns + monotonic_ns - self.start_ns

    def __getstate__(self) -> dict[str, object]:
        """Travel to a child process; a protobuf message goes as its bytes."""
        return self.__dict__ | {"info": self.info.SerializeToString()}

    def __setstate__(self, state: dict[str, object]) -> None:
        """Arrive in a child process."""
        self.__dict__.update(state)
        self.__dict__["info"] = pb.Info.FromString(state["info"])  # type: ignore[arg-type]


def ignore_terminal_signals() -> None:
    """Leave the signals that end us to the supervisor, which ends the processes in their order."""
    for number in ENDING_SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def end_with_parent(patience_s: float) -> None:
    """End this process some time after its supervisor, even if a library does not return.

    While the supervisor lives it sees to that itself.
    """
    parent = parent_process()
    if parent is None:
        return

    def wait() -> None:
        parent.join()
        time.sleep(patience_s)
        os._exit(1)

    threading.Thread(target=wait, name="end with parent", daemon=True).start()


def parent_is_alive() -> bool:
    """Whether the supervisor still runs."""
    parent = parent_process()
    return parent is not None and parent.is_alive()

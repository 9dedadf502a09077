"""What the daemon says on its terminal: one line a fact at the start, then its events."""

import time
from collections.abc import Callable
from datetime import UTC, datetime

from pneuarm.logs.rings.rings import MessageReader, Rings
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import EVENT
from pneuarm.service.configuration.configuration import rerun_url
from pneuarm.service.devices import registry as backends
from pneuarm.service.network.sessions import is_loopback
from pneuarm.service.processes.shared import REALTIME, START_FAILED, Shared

#: Lines a second; a flood of bad messages must not become a flood of lines.
_LINES_PER_S = 10


def start_facts(shared: Shared, realtime: str) -> list[str]:
    """One line a fact: arm, adapter, rate, priority, Zenoh endpoint, Rerun address, log."""
    configuration = shared.configuration
    arm, zenoh, rerun = configuration.arm, configuration.zenoh, configuration.rerun
    sections = len(arm.sections)
    device = backends.address(configuration)
    if configuration.is_simulated:
        device += f", seed {configuration.simulator.seed}"
    lines = [
        f"arm        {arm.name}: {sections} section{'s' * (sections > 1)}, {3 * sections} chambers",
        f"adapter    {configuration.hardware.adapter} (device {device})",
        f"rate       {configuration.control.rate_hz:g} Hz, law {configuration.control.law}",
        f"real time  {realtime}",
        f"zenoh      {', '.join(zenoh.listen)}",
        f"rerun      {rerun_url(configuration)}" if rerun.enabled else "rerun      off",
        f"log        {shared.info.log_path}",
    ]
    lines += [f"WARNING    {text}" for text in backends.warnings(configuration)]
    exposed = [endpoint for endpoint in zenoh.listen if not is_loopback(endpoint)]
    if exposed:
        lines.append(
            f"WARNING    listening on {', '.join(exposed)}: anyone on that network can move the arm"
        )
    if rerun.enabled and not rerun.bind.startswith(("127.", "::1")):
        lines.append(f"WARNING    Rerun's server listens on {rerun.bind}: anyone there can watch")
    return lines


class Announcer:
    """Prints events as they come, at most _LINES_PER_S a second; errors always."""

    def __init__(self, rings: Rings, say: Callable[[str], None]) -> None:
        self._reader = MessageReader(rings.messages())
        self._say = say
        self._second, self._lines, self._withheld = 0, 0, 0

    def step(self) -> None:
        """Print what is new."""
        for topic, payload, _ in self._reader.read():
            if topic is EVENT:
                event = pb.Event.FromString(payload)
                if event.code not in (REALTIME, START_FAILED):
                    self._event(event)

    def _event(self, event: pb.Event) -> None:
        second = int(time.monotonic())
        if second != self._second:
            if self._withheld:
                self._say(f"({self._withheld} more events, not shown here)")
            self._second, self._lines, self._withheld = second, 0, 0
        self._lines += 1
        if self._lines > _LINES_PER_S and event.level != pb.ERROR:
            self._withheld += 1
        else:
            self._say(event_line(event))


def event_line(event: pb.Event) -> str:
    """One event for a terminal: time, level, who, what, why, what to do."""
    clock = datetime.fromtimestamp(event.time_unix_ns / 1e9, UTC).strftime("%H:%M:%S.%f")[:-3]
    level = pb.Level.Name(event.level).lower()
    line = f"{clock} {level:7} {event.source}: {event.text}"
    if event.client_id:
        line += f" [{event.client_id}]"
    if event.cause:
        line += f" (cause: {event.cause})"
    if event.remedy:
        line += f" -> {event.remedy}"
    return line

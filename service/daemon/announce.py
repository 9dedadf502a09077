"""What the daemon says on its terminal: one line a fact at the start, then its events."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from pneuarm.logs.rings.rings import MessageReader, Rings
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.event_line import event_line
from pneuarm.logs.schema.topics import EVENT
from pneuarm.service.configuration.configuration import rerun_url
from pneuarm.service.devices import registry as backends
from pneuarm.service.network.endpoint import Endpoint
from pneuarm.service.processes.shared import REALTIME, START_FAILED, Shared
from pneuarm.service.processes.telling import sameness

#: Lines a second; a flood of bad messages must not become a flood of lines.
_LINES_PER_S = 10
_LONGEST_PAUSE_S = 60.0


def start_facts(shared: Shared, realtime: str) -> list[str]:
    """One line a fact: arm, adapter, rate, priority, Zenoh endpoint, Rerun address, log."""
    configuration = shared.configuration
    arm, zenoh, rerun = configuration.arm, configuration.zenoh, configuration.rerun
    sections = len(arm.sections)
    device = backends.address(configuration)
    if configuration.is_simulated:
        simulated = configuration.simulated
        device += f", seed {simulated.seed}, {simulated.valves} valves"
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
    exposed = [text for text in zenoh.listen if not Endpoint.parse(text).is_loopback]
    if exposed:
        lines.append(
            f"WARNING    listening on {', '.join(exposed)}: anyone on that network can move the arm"
        )
    if rerun.enabled and not rerun.bind.startswith(("127.", "::1")):
        lines.append(f"WARNING    Rerun's server listens on {rerun.bind}: anyone there can watch")
    return lines


@dataclass
class _Lasting:
    """An event that goes on: the newest of it that is not printed yet, and how many there were."""

    printed_s: float
    pause_s: float = 2.0
    newest: pb.Event | None = None
    repeats: int = 0


class Announcer:
    """Prints events as they come, at most _LINES_PER_S a second; errors always.

    What goes on is printed again after 2 s, then after twice as long each time, up to a minute.
    """

    def __init__(self, rings: Rings, say: Callable[[str], None]) -> None:
        self._reader = MessageReader(rings.messages())
        self._say = say
        self._second, self._lines, self._withheld = 0, 0, 0
        self._lasting: dict[tuple[str, str, str], _Lasting] = {}

    def step(self) -> None:
        """Print what is new."""
        for topic, payload, _ in self._reader.read():
            if topic is EVENT:
                event = pb.Event.FromString(payload)
                if event.code not in (REALTIME, START_FAILED):
                    self._take(event)
        self._print_lasting(time.monotonic())

    def _take(self, event: pb.Event) -> None:
        lasting = self._lasting.get(sameness(event))
        if event.repeats and lasting is not None:
            lasting.newest, lasting.repeats = event, lasting.repeats + event.repeats
        else:
            self._lasting[sameness(event)] = _Lasting(time.monotonic())
            self._print(event)

    def _print_lasting(self, now_s: float) -> None:
        for key, lasting in list(self._lasting.items()):
            if now_s - lasting.printed_s < lasting.pause_s:
                continue
            if lasting.newest is None:
                del self._lasting[key]
                continue
            lasting.newest.repeats = lasting.repeats
            self._print(lasting.newest)
            self._lasting[key] = _Lasting(now_s, min(2.0 * lasting.pause_s, _LONGEST_PAUSE_S))

    def _print(self, event: pb.Event) -> None:
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

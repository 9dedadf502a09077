"""What control and the device process tell each other: one slot each way in shared memory.

A slot is a short ring with one writer: its newest record, with its number and checksum, is whole or
it is not taken. Nobody waits for anybody.
"""

from dataclasses import dataclass
from enum import IntEnum
from multiprocessing.context import SpawnContext

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.guard import Guarded, Intervention
from pneuarm.hardware.interface import Measurement
from pneuarm.logs.rings.ring import RingMemory, RingReader, RingWriter

#: Records in a slot: a reader is torn only when the writer goes round meanwhile.
_CAPACITY = 8
_TEXT_BYTES = 500

#: A device process that has said nothing for this long (s) is stuck, and its numbers are history.
SILENT_S = 0.3


class LinkState(IntEnum):
    """How the device process stands with its device."""

    STARTING = 0  # being connected, which may take long
    CONNECTED = 1
    LOST = 2  # it does not answer as it must; tried again and again
    SILENT = 3  # commands were too old: zeros were sent, then nothing, not even reads


class Order(IntEnum):
    """What a command asks for."""

    VENT = 0
    REGULATE = 1


@dataclass(frozen=True)
class DeviceLink:
    """The shared memory of both slots; hand it to child processes as an argument."""

    commands: RingMemory
    reports: RingMemory
    n_sections: int

    @classmethod
    def create(cls, context: SpawnContext, n_sections: int) -> "DeviceLink":
        """Make the empty slots."""
        sizes = (_command_type(n_sections).itemsize, _report_type(n_sections).itemsize)
        commands, reports = (RingMemory.create(context, _CAPACITY, size) for size in sizes)
        return cls(commands, reports, n_sections)


def _command_type(n_sections: int) -> np.dtype[np.void]:
    return np.dtype(
        [("pressures_pa", "<f8", (n_sections, 3)), ("commanded_at_s", "<f8"), ("order", "<u4")]
    )


def _report_type(n_sections: int) -> np.dtype[np.void]:
    chambers = (n_sections, 3)
    return np.dtype(
        [
            ("pressures_pa", "<f8", chambers),
            ("lengths_m", "<f8", chambers),
            ("setpoints_pa", "<f8", chambers),
            ("sent_pa", "<f8", chambers),
            ("supply_pa", "<f8"),
            ("taken_s", "<f8"),
            ("published_s", "<f8"),
            ("state", "<u4"),
            ("connections", "<u4"),
            ("intervention", "<u4"),
            ("interventions", "<u8"),
            ("stop_pressed", "<u4"),
            ("has_setpoints", "<u4"),
            ("text", f"S{_TEXT_BYTES}"),
            ("complaints", f"S{_TEXT_BYTES}"),
        ]
    )


class _Writer:
    """Writes one kind of record into a slot."""

    def __init__(self, memory: RingMemory, kind: np.dtype[np.void]) -> None:
        self._ring = RingWriter(memory)
        self.record = np.zeros((), dtype=kind)
        self._bytes = self.record.reshape(1).view(np.uint8).data

    def publish(self) -> None:
        self._ring.write(self._bytes)


class _Reader:
    """Reads the newest whole record of a slot."""

    def __init__(self, memory: RingMemory, kind: np.dtype[np.void]) -> None:
        self._ring, self._kind = RingReader(memory), kind
        self.sequence = 0
        self.record: np.void | None = None

    def newest(self) -> "np.void | None":
        """Return the newest record, the last whole one if that is torn, None before the first."""
        head = self._ring.head()
        if head != self.sequence:
            payload = self._ring.record(head)
            if payload is not None:
                self.sequence, self.record = head, np.frombuffer(payload, self._kind)[0]
        return self.record


@dataclass(frozen=True)
class DeviceCommand:
    """What control last asked for, and the how-manieth command it was."""

    sequence: int
    order: Order
    pressures_pa: Array
    commanded_at_s: float


@dataclass(frozen=True)
class Standing:
    """How the device process stands, for whoever looks from outside."""

    state: LinkState
    published_s: float
    text: str


class LinkedDevice:
    """Control's end; satisfies :class:`pneuarm.hardware.guarded.GuardedHardware`. It never waits.

    The guard is at the other end, right before the transport.
    """

    def __init__(self, link: DeviceLink) -> None:
        self._commands = _Writer(link.commands, _command_type(link.n_sections))
        self._reports = _Reader(link.reports, _report_type(link.n_sections))
        self._zeros = np.zeros((link.n_sections, 3))
        self._last = self._sent = self._zeros
        self._connections: int | None = None
        self._interventions = 0
        self._intervention = Intervention.NOTHING

    @property
    def sent_pa(self) -> Array:
        """What the device last acknowledged, (n_sections, 3)."""
        return self._sent

    def connect(self) -> None:
        """Nothing: the device process connects, and the supervisor has waited for it."""

    def read(self, time_s: float) -> Measurement:
        """Return the newest measurement; raises HardwareError while the device is not there.

        Also once after it was away, however short: the arm was vented, and control must know.
        """
        report = self._reports.newest()
        if report is None:
            raise HardwareError("the device process has not reported yet")
        self._sent = report["sent_pa"]
        self._check(report, time_s)
        self._take_interventions(report)
        complaints = report["complaints"].decode(errors="replace")
        return Measurement(
            pressures_pa=report["pressures_pa"],
            lengths_m=report["lengths_m"],
            taken_s=float(report["taken_s"]),
            setpoints_pa=report["setpoints_pa"] if report["has_setpoints"] else None,
            supply_pa=float(report["supply_pa"]),
            stop_pressed=bool(report["stop_pressed"]),
            complaints=tuple(complaints.split("\n")) if complaints else (),
        )

    def _check(self, report: np.void, time_s: float) -> None:
        text = report["text"].decode(errors="replace")
        if report["state"] == LinkState.STARTING:
            raise HardwareError(text or "the device is being connected")
        if report["state"] != LinkState.CONNECTED:
            raise HardwareError(text)
        age_s = time_s - float(report["published_s"])
        if age_s > SILENT_S:
            raise HardwareError(
                f"the device process has said nothing for {age_s:.2f} s: it is stuck or dead; "
                "the supervisor starts it again, then reset"
            )
        before, self._connections = self._connections, int(report["connections"])
        if before not in (None, self._connections):
            raise HardwareError(f"the device was away and is connected again, vented: {text}")

    def _take_interventions(self, report: np.void) -> None:
        total = int(report["interventions"])
        changed, self._interventions = total != self._interventions, total
        self._intervention = Intervention(int(report["intervention"]) if changed else 0)

    def write(self, pressures_pa: Array, commanded_at_s: float, now_s: float) -> Guarded:
        """Hand a command over; return it, and what the guard changed in those before.

        What the device acknowledged is ``sent_pa``, some milliseconds later.
        """
        self._hand_over(Order.REGULATE, pressures_pa, commanded_at_s)
        self._last = np.where(np.isfinite(pressures_pa), pressures_pa, self._last)
        return Guarded(self._last, self._intervention)

    def vent(self, time_s: float) -> None:
        """Ask for zeros."""
        self._hand_over(Order.VENT, self._zeros, time_s)
        self._last = self._zeros

    def _hand_over(self, order: Order, pressures_pa: Array, commanded_at_s: float) -> None:
        record = self._commands.record
        record["order"], record["commanded_at_s"] = int(order), commanded_at_s
        record["pressures_pa"] = pressures_pa
        self._commands.publish()

    def close(self) -> None:
        """Nothing: the device process closes the device when it ends."""


class DeviceEnd:
    """The device process's end; one that follows a dead one goes on with its counters."""

    def __init__(self, link: DeviceLink) -> None:
        self._commands = _Reader(link.commands, _command_type(link.n_sections))
        self._reports = _Writer(link.reports, _report_type(link.n_sections))
        before = _Reader(link.reports, _report_type(link.n_sections)).newest()
        if before is not None:
            for name in ("connections", "interventions"):
                self._reports.record[name] = before[name]
        self._forget()

    def _forget(self) -> None:
        """Know nothing of the device any more."""
        for name in ("pressures_pa", "lengths_m", "setpoints_pa", "supply_pa", "sent_pa"):
            self._reports.record[name] = np.nan
        self._reports.record["complaints"] = b""

    def command(self) -> DeviceCommand | None:
        """Return the newest command, None before the first."""
        record = self._commands.newest()
        if record is None:
            return None
        return DeviceCommand(
            self._commands.sequence,
            Order(int(record["order"])),
            record["pressures_pa"],
            float(record["commanded_at_s"]),
        )

    def say(self, state: LinkState, now_s: float, text: str | None = None) -> None:
        """Tell a state without a new measurement."""
        record = self._reports.record
        if state == LinkState.CONNECTED and record["state"] != state:
            record["connections"] += 1
        if state in (LinkState.LOST, LinkState.SILENT):
            self._forget()
        record["state"], record["published_s"] = int(state), now_s
        if text is not None:
            record["text"] = text.encode()[:_TEXT_BYTES]
        self._reports.publish()

    def intervened(self, intervention: Intervention) -> None:
        """Count what the guard has changed."""
        if intervention:
            self._reports.record["intervention"] = int(intervention)
            self._reports.record["interventions"] += 1

    def measured(self, measurement: Measurement, taken_s: float, now_s: float) -> None:
        """Tell a measurement; the time of the adapter's own goes before that of the call."""
        record = self._reports.record
        record["pressures_pa"], record["lengths_m"] = (
            measurement.pressures_pa,
            measurement.lengths_m,
        )
        known = measurement.setpoints_pa is not None
        record["has_setpoints"] = known
        record["setpoints_pa"] = measurement.setpoints_pa if known else np.nan
        record["supply_pa"] = measurement.supply_pa
        record["stop_pressed"] = measurement.stop_pressed
        record["complaints"] = "\n".join(measurement.complaints).encode()[:_TEXT_BYTES]
        record["taken_s"] = taken_s if measurement.taken_s is None else measurement.taken_s
        self.say(LinkState.CONNECTED, now_s)

    def sent(self, sent_pa: Array) -> None:
        """Note what the device acknowledged; told with the next measurement."""
        self._reports.record["sent_pa"] = sent_pa


class DeviceWatch:
    """The supervisor's eye on the device process."""

    def __init__(self, link: DeviceLink) -> None:
        self._reports = _Reader(link.reports, _report_type(link.n_sections))

    def standing(self) -> Standing | None:
        """Return how the device process stands, None before its first word."""
        report = self._reports.newest()
        if report is None:
            return None
        text = report["text"].decode(errors="replace")
        return Standing(LinkState(int(report["state"])), float(report["published_s"]), text)

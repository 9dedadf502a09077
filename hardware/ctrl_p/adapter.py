"""The Ctrl-P pressure controller as an arm's air."""

import math
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import ConfigurationError, HardwareError
from pneuarm.hardware.channels import CallOrder, Channels, StepCommand
from pneuarm.hardware.ctrl_p import protocol
from pneuarm.hardware.ctrl_p.protocol import Echo, Kind, Mode, Telemetry
from pneuarm.hardware.interface import Measurement
from pneuarm.hardware.setpoints import SentSetpoints
from pneuarm.hardware.transports.serial_line import SerialLine

WHAT = "the Ctrl-P controller"

#: A reading waits for new telemetry, as many of its periods at most.
READ_WAIT_PERIODS = 1.5
#: A setpoint that has not changed, a vent, and the question for the mode are repeated (s).
REPEAT_S = 0.2
#: What was set at the connection is read back so often (s), for ever.
LOOK_S = 1.0
#: So many questions for one setting may stay without an answer: lines get lost.
MOST_UNANSWERED = 2

TRIPPED = (
    "its own over-pressure protection has emptied every channel: a pressure was above ceiling_bar"
)


@dataclass(frozen=True)
class CtrlPSettings:
    """Where the controller is, and how it is wired to the arm.

    ``channels`` is the number the firmware was built for, ``valves`` the channel, from 0, of each
    chamber. Above ``ceiling_pa`` the controller itself empties all channels.
    """

    device: str
    valves: tuple[int, ...]
    channels: int = 8
    baud: int = 115200
    ceiling_pa: float = 1.5e5
    telemetry_s: float = 0.02
    timeout_s: float = 0.5
    connect_timeout_s: float = 3.0


class CtrlP:
    """One controller on one port; it satisfies :class:`pneuarm.hardware.interface.Hardware`."""

    def __init__(self, arm: Arm, settings: CtrlPSettings) -> None:
        """Raise ConfigurationError where the wiring or the ceiling does not fit the arm."""
        self._settings = settings
        self._channels = Channels(arm, settings.channels, settings.valves, "[ctrl_p] valves")
        largest_pa = float(arm.per_chamber("pressure_max_pa").max())
        if largest_pa > settings.ceiling_pa:
            raise ConfigurationError(
                f"[ctrl_p] ceiling_bar = {settings.ceiling_pa / 1e5:g} is below the arm's "
                f"pressure_max_bar = {largest_pa / 1e5:g}: the controller would empty the arm by "
                "itself; lower the arm's limit, or raise the ceiling if the arm bears it"
            )
        self._smallest_pa = float(arm.per_chamber("pressure_min_pa").min())
        self._command = StepCommand(arm, protocol.STEP_PA, WHAT)
        remedy = "check its power, its USB cable and [ctrl_p] device"
        self._line = SerialLine(settings.device, settings.baud, WHAT, remedy)
        self._order = CallOrder(WHAT)
        self._unknown = np.full((arm.n_sections, 3), np.nan)
        self._setpoints = SentSetpoints(0.6 * protocol.STEP_PA)
        self._open = False

    def connect(self) -> None:
        """Empty the arm, make the controller speak kPa, and wait for its first telemetry.

        Raises HardwareError where it does not answer, knows no kPa, or has another number of
        channels; the arm is emptied before anything else is asked.
        """
        self.close()
        self._line.open()
        self._open = True
        try:
            self._set_up()
        except HardwareError:
            self.close()
            raise
        self._order.begin()

    def _set_up(self) -> None:
        settings = self._settings
        self._forget()
        # The empty line ends what a host that died may have left half sent.
        for line in (b"\n", protocol.TELEMETRY_OFF, *protocol.vent(settings.channels)):
            self._line.send(line)
        self._ask(protocol.ECHO_ON, "ECHO")
        units = self._keep(protocol.USE_KPA, "UNITS")
        if not protocol.is_in_kpa(units):
            raise self._line.error(
                f"was asked for kPa and answers in {' and '.join(units.values) or 'no unit'}, so "
                "that its pressures would be wrong by a factor"
            )
        self._keep(protocol.largest_pressure(settings.ceiling_pa), "MAXP")
        self._keep(protocol.smallest_pressure(self._smallest_pa), "MINP")
        self._keep(protocol.ALL_CHANNELS_ON, "CHAN")
        self._keep(protocol.telemetry_period(settings.telemetry_s), "TIME")
        self._ask(protocol.mode(Mode.VALVE), "MODE")
        self._line.send(protocol.TELEMETRY_ON)
        first = self._line.wait_for(self._measured, settings.connect_timeout_s, "with telemetry")
        if len(first.values_kpa) != settings.channels:
            raise self._line.error(
                f"has {len(first.values_kpa)} channels and [ctrl_p] channels = "
                f"{settings.channels}, so that a setpoint would reach the wrong chambers"
            )
        self._take(first)

    def _forget(self) -> None:
        """Start with nothing known, vented."""
        self._values = dict.fromkeys((Kind.SETPOINTS, Kind.MEASURED), self._unknown)
        self._supply_pa = math.nan
        self._sent = np.zeros_like(self._unknown)
        self._setpoints.begin(self._sent)
        self._armed = self._reported_armed = self._tripped = False
        self._fresh = True
        self._heard_s = self._sent_s = self._asked_s = -math.inf
        self._kept: dict[str, tuple[str, ...]] = {}
        self._strange: dict[str, int] = {}
        self._unanswered: dict[str, int] = {}
        self._looked_s: float | None = None

    def _keep(self, command: bytes, name: str) -> Echo:
        """Set something that safety rests on, and remember what the controller says it is now."""
        echo = self._ask(command, name)
        self._kept[name] = echo.values
        return echo

    def _look_at_kept(self, time_s: float) -> None:
        """Ask once a second for all that was set at the connection; the echoes are compared."""
        if self._looked_s is None:
            self._looked_s = time_s
        if time_s - self._looked_s >= LOOK_S:
            self._looked_s = time_s
            for name in self._kept:
                self._ask_for_kept(name)

    def _ask_for_kept(self, name: str) -> None:
        """Raise HardwareError where it says nothing any more, as with its echo switched off."""
        asked = self._unanswered.get(name, 0)
        if asked > MOST_UNANSWERED:
            raise self._line.error(
                f"did not say its {name.lower()} when it was asked {asked} times; another program "
                "may have switched its echo off, and it is set again at the next connection"
            )
        self._unanswered[name] = asked + 1
        self._line.send(protocol.ask(name))

    def _check_kept(self, echo: Echo) -> None:
        """Raise HardwareError where a setting is another one now, and has been so twice."""
        kept = self._kept.get(echo.name)
        same = kept is None or echo.values == kept
        self._unanswered[echo.name] = 0
        self._strange[echo.name] = 0 if same else self._strange.get(echo.name, 0) + 1
        if kept is not None and self._strange[echo.name] > 1:
            raise self._line.error(
                f"has {echo.name.lower()} = {' '.join(echo.values)}, and it was set to "
                f"{' '.join(kept)}; another program or a restart changed it, and it is set again "
                "at the next connection"
            )

    def _ask(self, command: bytes, name: str) -> Echo:
        """Send a command and return its echo; raises HardwareError where it is not known."""
        self._line.send(command)
        asked = command.decode().strip()

        def answer(line: bytes) -> Echo | None:
            said = protocol.parse(line)
            return said if isinstance(said, Echo) and said.name == name else None

        return self._line.wait_for(answer, self._settings.connect_timeout_s, f"{asked!r}")

    @staticmethod
    def _measured(line: bytes) -> Telemetry | None:
        said = protocol.parse(line)
        measured = isinstance(said, Telemetry) and said.kind == Kind.MEASURED
        return said if measured and isinstance(said, Telemetry) else None

    def read(self, time_s: float) -> Measurement:
        """Return the next telemetry, or the newest there is where none comes in its time.

        Raises HardwareError after ``timeout_s`` without any, for setpoints that were not sent, for
        a setting that is no longer what it was set to, and once its own over-pressure protection
        has acted, until the next vent.
        """
        self._order.check(time_s)
        self._line.take_until(self._heard, READ_WAIT_PERIODS * self._settings.telemetry_s)
        fresh, self._fresh = self._fresh, False
        if fresh:
            self._heard_s = time_s
        if time_s - self._heard_s > self._settings.timeout_s:
            raise self._line.error(f"has sent no telemetry for {time_s - self._heard_s:.1f} s")
        self._watch_mode(time_s)
        self._look_at_kept(time_s)
        return Measurement(
            pressures_pa=self._values[Kind.MEASURED].copy(),
            lengths_m=self._unknown.copy(),
            taken_s=None if fresh else self._heard_s,
            setpoints_pa=self._values[Kind.SETPOINTS].copy(),
            supply_pa=self._supply_pa,
            complaints=(f"{WHAT}: {TRIPPED}",) if self._tripped else (),
        )

    def _heard(self, line: bytes) -> bool:
        """Take a line; return whether the channels' pressures have come by now."""
        self._line.count(self._take(protocol.parse(line)), line)
        return self._fresh

    def _take(self, said: Telemetry | Echo | None) -> bool:
        """Take what a line says; return whether it says anything."""
        if isinstance(said, Echo):
            return self._take_echo(said)
        if said is None:
            return False
        if said.kind == Kind.SUPPLY:
            self._supply_pa = said.values_kpa[0] * protocol.KPA
            return True
        if len(said.values_kpa) != self._settings.channels:
            return False
        values_pa = self._channels.gather(said.values_kpa) * protocol.KPA
        self._values[said.kind] = values_pa
        self._fresh |= said.kind == Kind.MEASURED
        if said.kind == Kind.SETPOINTS and self._setpoints.are_foreign(values_pa):
            raise self._line.error(f"has setpoints of {said.values_kpa} kPa, which nobody sent")
        return True

    def _take_echo(self, echo: Echo) -> bool:
        """Take an echo; one of the mode says whether the controller has let the air out itself."""
        self._check_kept(echo)
        if echo.name != "MODE":
            return echo.name != "UNREC"
        modes = protocol.modes(echo)
        if modes is None:
            return False
        regulates = all(mode == Mode.PRESSURE for mode in modes)
        # An answer to a question asked before the order to regulate was carried out is no trip.
        if self._armed and self._reported_armed and not regulates:
            self._tripped = True
        self._reported_armed = regulates
        return True

    def _watch_mode(self, time_s: float) -> None:
        """Ask for the mode now and then; raise HardwareError for one that is not ours."""
        if self._tripped and self._armed:
            raise HardwareError(
                f"{WHAT} at {self._settings.device}: {TRIPPED}; find the cause, then reset and "
                "arm again"
            )
        if self._armed and time_s - self._asked_s >= REPEAT_S:
            self._line.send(protocol.ASK_MODE)
            self._asked_s = time_s

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        """Send setpoints (n_sections, 3); return them as sent, in steps of 10 Pa.

        Raises HardwareError for a command that is none, and where it cannot be sent.
        """
        self._order.check(time_s)
        wanted = self._command.sendable_pa(pressures_pa)
        overdue = time_s - self._sent_s >= REPEAT_S
        if overdue or not self._armed or not np.array_equal(wanted, self._sent):
            self._line.send(protocol.setpoints(self._channels.scatter(wanted)))
            self._sent, self._sent_s = wanted, time_s
            self._setpoints.add(wanted)
            self._regulate()
        return self._sent.copy()

    def _regulate(self) -> None:
        """Let the channels regulate their pressures, where they do not yet."""
        if not self._armed:
            self._line.send(protocol.mode(Mode.PRESSURE))
            self._armed, self._reported_armed, self._tripped = True, False, False

    def vent(self, time_s: float) -> None:
        """Send zeros and open every valve to ambient; repeated while it is called."""
        time_s = self._order.at_any_time(time_s)
        if self._armed or time_s - self._sent_s >= REPEAT_S:
            self._armed, self._sent_s = False, time_s
            self._sent = np.zeros_like(self._sent)
            self._setpoints.add(self._sent)
            self._send_vent()

    def _send_vent(self) -> None:
        for line in protocol.vent(self._settings.channels):
            self._line.send(line)

    def close(self) -> None:
        """Empty the arm, wait until the controller says so, and let the port go."""
        was_open, self._open = self._open, False
        self._order.end()
        if was_open:
            with suppress(HardwareError):  # a device that has gone cannot be told
                self._line.send(protocol.TELEMETRY_OFF)
                self._send_vent()
                self._line.wait_for(self._vented, self._settings.timeout_s, "that it is empty")
        self._line.close()

    @staticmethod
    def _vented(line: bytes) -> bool | None:
        said = protocol.parse(line)
        if not isinstance(said, Echo) or said.name != "MODE" or not said.new:
            return None
        modes = protocol.modes(said)
        return True if modes is not None and not any(modes) else None

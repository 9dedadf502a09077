"""The ESP32 controller of three chambers as an arm's air."""

import itertools
import math
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import ConfigurationError, HardwareError
from pneuarm.hardware.channels import CallOrder, Channels, StepCommand
from pneuarm.hardware.esp32 import protocol
from pneuarm.hardware.esp32.protocol import Feedback, Remark
from pneuarm.hardware.interface import Measurement
from pneuarm.hardware.setpoints import SentSetpoints
from pneuarm.hardware.transports.serial_line import SerialLine

WHAT = "the ESP32 controller"

#: A reading waits so long for new feedback (s), which comes once a pass.
READ_WAIT_S = 1.5 * protocol.PASS_S
#: Of commands that come sooner than this after another the firmware forgets one (s). They follow
#: feedback, and therefore one another, at one pass.
WRITE_INTERVAL_S = 0.75 * protocol.PASS_S
#: A command that the feedback does not show by then is sent again (s).
REPEAT_S = 4.0 * protocol.PASS_S

#: Feedback repeats a target with two decimals of a kilopascal or more.
_SAME_PA = 0.6 * protocol.STEP_PA


@dataclass(frozen=True)
class Esp32Settings:
    """Where the controller is, and how it is wired to the arm.

    ``valves`` is the controller's chamber, from 0, of each of the arm's. ``potentiometers`` are,
    for each chamber of the arm, the numbers (1 to 6) of those whose mean is its length; empty
    where lengths are not measured. Opening the port restarts most of these boards, which then need
    some seconds.
    """

    device: str
    valves: tuple[int, ...] = (0, 1, 2)
    potentiometers: tuple[tuple[int, ...], ...] = ()
    baud: int = 115200
    ceiling_pa: float = protocol.CEILING_PA
    timeout_s: float = 0.5
    connect_timeout_s: float = 8.0


class Esp32:
    """One controller on one port; it satisfies :class:`pneuarm.hardware.interface.Hardware`.

    ``imu_deg`` is the newest roll, pitch and yaw, NaN where there is none.
    """

    def __init__(self, arm: Arm, settings: Esp32Settings) -> None:
        """Raise ConfigurationError where the arm does not fit the controller, or the wiring."""
        self._settings, self._arm = settings, arm
        if arm.n_chambers != protocol.CHAMBERS:
            raise ConfigurationError(
                f"adapter 'esp32' has {protocol.CHAMBERS} chambers and arm {arm.name!r} has "
                f"{arm.n_chambers}: it moves arms of one section"
            )
        self._channels = Channels(arm, protocol.CHAMBERS, settings.valves, "[esp32] valves")
        _check_range(arm, settings.ceiling_pa)
        _check_potentiometers(arm, settings.potentiometers)
        self._command = StepCommand(arm, protocol.STEP_PA, WHAT)
        remedy = "check its power, its USB cable and [esp32] device"
        self._line = SerialLine(settings.device, settings.baud, WHAT, remedy)
        self._order = CallOrder(WHAT)
        self._setpoints = SentSetpoints(_SAME_PA)
        self._open = False

    def connect(self) -> None:
        """Wait for the controller's feedback, and set zeros until the feedback shows them.

        Raises HardwareError where it does not answer, or does not take zeros.
        """
        self.close()
        self._line.open()
        self._open = True
        self._forget()
        try:
            wait_s = self._settings.connect_timeout_s
            self._line.wait_for(self._feedback_of, wait_s, "with feedback")
            self._empty(wait_s)
        except HardwareError:
            self.close()
            raise
        self._order.begin()

    def _forget(self) -> None:
        """Start with nothing known, vented."""
        self._newest: Feedback | None = None
        self._sent: Array = np.zeros((1, protocol.CHAMBERS))
        self._setpoints.begin(self._sent)
        self._heard_s = self._sent_s = -math.inf
        self._fresh = True
        self._remark = ""
        self.imu_deg: tuple[float, ...] = (math.nan,) * 3

    @staticmethod
    def _feedback_of(line: bytes) -> Feedback | None:
        said = protocol.parse(line)
        return said if isinstance(said, Feedback) else None

    def _empty(self, wait_s: float) -> None:
        """Send zeros until the feedback shows them; raises HardwareError after ``wait_s``.

        The firmware forgets a command that comes right after another, and feedback from before the
        zeros proves nothing: they are sent again two passes later, when nothing else can be on its
        way, and what is said two passes after that counts. Then the same again.
        """
        self._line.receive(0.0)
        passes = itertools.count(1)

        def is_empty(line: bytes) -> bool | None:
            feedback = self._feedback_of(line)
            if feedback is None:
                return None
            self._newest = feedback
            number = next(passes)
            if number % 4 == 0 and not any(feedback.targets_kpa):
                return True
            if number % 4 == 2:
                self._line.send(protocol.VENT)
            return None

        self._line.send(protocol.VENT)
        self._line.wait_for(is_empty, wait_s, "zeros")

    def read(self, time_s: float) -> Measurement:
        """Return the next feedback, or the newest there is where none comes in its time.

        Raises HardwareError after ``timeout_s`` without any, and for targets that were not sent.
        """
        self._order.check(time_s)
        self._line.take_until(self._heard, READ_WAIT_S)
        fresh, self._fresh = self._fresh, False
        if fresh:
            self._heard_s = time_s
        if time_s - self._heard_s > self._settings.timeout_s:
            raise self._line.error(f"has sent no feedback for {time_s - self._heard_s:.1f} s")
        return self._measurement(self._known(), None if fresh else self._heard_s)

    def _heard(self, line: bytes) -> bool:
        """Take a line; return whether it, or one before it, was feedback."""
        self._line.count(self._take(protocol.parse(line)), line)
        return self._fresh

    def _take(self, said: Feedback | Remark | None) -> bool:
        """Take what a line says; return whether it says anything."""
        if isinstance(said, Feedback):
            self._newest, self._fresh = said, True
            self.imu_deg = said.imu_deg
            if self._setpoints.are_foreign(self._channels.gather(said.targets_kpa) * protocol.KPA):
                raise self._line.error(f"has targets of {said.targets_kpa} kPa, which nobody sent")
        elif isinstance(said, Remark):
            self._remark = said.text if said.is_error else ""
        return said is not None

    def _known(self) -> Feedback:
        if self._newest is None:
            raise self._line.error("has sent no feedback yet")
        return self._newest

    def _measurement(self, feedback: Feedback, taken_s: float | None) -> Measurement:
        pressures_pa = self._channels.gather(feedback.pressures_kpa) * protocol.KPA
        return Measurement(
            pressures_pa=pressures_pa,
            lengths_m=self._lengths_m(feedback.potentiometers_mm),
            taken_s=taken_s,
            setpoints_pa=self._channels.gather(feedback.targets_kpa) * protocol.KPA,
            complaints=(f"{WHAT} says: {self._remark}",) if self._remark else (),
        )

    def _lengths_m(self, potentiometers_mm: tuple[float, ...]) -> Array:
        """Mean of each chamber's potentiometers; NaN where one of them is missing."""
        lengths_m = np.full((1, protocol.CHAMBERS), np.nan)
        for chamber, numbers in enumerate(self._settings.potentiometers):
            values = [potentiometers_mm[number - 1] for number in numbers]
            lengths_m[0, chamber] = 1e-3 * sum(values) / len(values)
        return lengths_m

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        """Send setpoints (n_sections, 3); return those that it has now, in steps of 10 Pa.

        Sooner than ``WRITE_INTERVAL_S`` after the last one nothing is sent, and the last is
        returned. Raises HardwareError for a command that is none, and where it cannot be sent.
        """
        self._order.check(time_s)
        wanted = self._command.sendable_pa(pressures_pa)
        changed = not np.array_equal(wanted, self._sent)
        if time_s - self._sent_s >= (WRITE_INTERVAL_S if changed else REPEAT_S) and (
            changed or not self._shows(wanted)
        ):
            self._send(wanted, time_s)
        return self._sent.copy()

    def _send(self, pressures_pa: Array, time_s: float) -> None:
        self._line.send(protocol.set_pressures(self._channels.scatter(pressures_pa)))
        self._sent, self._sent_s = pressures_pa.copy(), time_s
        self._setpoints.add(pressures_pa)

    def _shows(self, pressures_pa: Array) -> bool:
        """Whether the newest feedback has these targets."""
        targets_pa = self._channels.gather(self._known().targets_kpa) * protocol.KPA
        return bool((np.abs(targets_pa - pressures_pa) <= _SAME_PA).all())

    def vent(self, time_s: float) -> None:
        """Send zeros; after another command, wait four passes until the feedback shows them.

        Raises HardwareError where it does not.
        """
        time_s = self._order.at_any_time(time_s)
        zeros = np.zeros_like(self._sent)
        if self._sent.any():
            self._sent, self._sent_s, self._heard_s = zeros, time_s, time_s
            self._setpoints.add(zeros)
            self._empty(self._settings.timeout_s)
        elif time_s - self._sent_s >= REPEAT_S and not self._shows(zeros):
            self._send(zeros, time_s)

    def close(self) -> None:
        """Empty the arm, wait until the feedback shows it, and let the port go."""
        was_open, self._open = self._open, False
        self._order.end()
        if was_open:
            with suppress(HardwareError):  # a device that has gone cannot be told
                self._empty(self._settings.timeout_s)
        self._line.close()


def _check_range(arm: Arm, ceiling_pa: float) -> None:
    low_pa = float(arm.per_chamber("pressure_min_pa").min())
    high_pa = float(arm.per_chamber("pressure_max_pa").max())
    if low_pa < 0.0 or high_pa > ceiling_pa:
        raise ConfigurationError(
            f"arm {arm.name!r} has pressures from {low_pa / 1e5:g} to {high_pa / 1e5:g} bar, and "
            f"the ESP32 controller gives 0 to {ceiling_pa / 1e5:g} bar ([esp32] ceiling_bar): set "
            "pressure_min_bar and pressure_max_bar of the section inside that"
        )


def _check_potentiometers(arm: Arm, potentiometers: tuple[tuple[int, ...], ...]) -> None:
    numbers = [number for of_one in potentiometers for number in of_one]
    fits = len(potentiometers) == arm.n_chambers and all(potentiometers)
    in_range = all(1 <= number <= protocol.POTENTIOMETERS for number in numbers)
    if potentiometers and not (fits and in_range):
        raise ConfigurationError(
            f"[esp32] potentiometers = {[list(of_one) for of_one in potentiometers]}: a list for "
            f"each of the {arm.n_chambers} chambers is needed, of the numbers 1 to "
            f"{protocol.POTENTIOMETERS} of its potentiometers; or [] where there are none"
        )

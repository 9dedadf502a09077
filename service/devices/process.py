"""The device process: the guard and a blocking transport, away from the loop.

It moves the arm only while control's commands are fresh. When they are not it sends zeros and then
nothing at all, so that the device's own watchdog runs out if this was not enough. After a gap in
its own exchanges it does not go on either: meanwhile the device may have vented by itself.
"""

import time
from multiprocessing.connection import Connection

from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.guard import Guard
from pneuarm.hardware.guarded import GuardedDevice
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.devices import registry as backends
from pneuarm.service.processes import realtime
from pneuarm.service.processes.device_slots import (
    SILENT_S,
    DeviceCommand,
    DeviceEnd,
    DeviceLink,
    LinkState,
    Order,
)
from pneuarm.service.processes.lock import Lock
from pneuarm.service.processes.shared import Shared, ignore_terminal_signals, parent_is_alive

#: Control's first commands, while it warms up, come in no order of time: until this many have come
#: nothing but zeros was ever asked for, and this process keeps the device content by itself.
WARM_UP_COMMANDS = 10

#: Runs on while the machine is suspended, as the device's watchdog does; the monotonic clock, by
#: which commands get old, stands still then.
_GAP_CLOCK = time.CLOCK_BOOTTIME

_RETRY_S = 0.3
_IDLE_S = 0.005
_VENT_BEFORE_END_S = 3.0


class DeviceProcess:
    """Serves one device until the order to end, or until its parent is gone."""

    def __init__(self, configuration: Configuration, link: DeviceLink, end: Connection) -> None:
        arm = configuration.build_arm()
        period_s = 1.0 / configuration.control.rate_hz
        self._period_s = 1.0 / min(
            configuration.hardware.exchange_rate_hz, configuration.control.rate_hz
        )
        flow_pa_s = configuration.hardware.supply_flow_limit_pa_s
        guard = Guard(arm, period_s, flow_pa_s, self._period_s)
        self._device = GuardedDevice(backends.build(configuration, arm), guard, arm.n_sections)
        self._look_first_s = guard.max_elapsed_s
        watchdog_s = configuration.device.watchdog_s(configuration.of_device(configuration.device))
        self._gap_max_s = 0.5 * min(watchdog_s, SILENT_S)
        self._exchanged_s = 0.0
        self._link = DeviceEnd(link)
        self._max_age_s = max(Guard.MAX_AGE_PERIODS * period_s, Guard.MAX_AGE_S)
        self._end = end
        self._connected = self._may_regulate = self._silent = False
        self._retry_s = 0.0
        self._parent_gone_s: float | None = None

    def run(self) -> None:
        """Serve; leave the device vented and closed, whatever happens in between."""
        due_s = time.monotonic()
        try:
            while not self._is_over():
                self.step()
                due_s = max(due_s + self._period_s, time.monotonic())
                time.sleep(max(0.0, due_s - time.monotonic()))
        finally:
            self._let_go()

    def step(self) -> None:
        """One exchange with the device, or what stands in its place."""
        command = self._link.command()
        if self._is_fresh(command):
            self._silent = False
        elif not self._silent:
            self._fall_silent(command)
        if self._silent:
            return
        if not self._connected:
            self._connect()
        else:
            self._exchange(command)

    def _is_fresh(self, command: DeviceCommand | None) -> bool:
        """Whether control is alive by its commands; it need not be before it has begun."""
        if command is None or command.sequence <= WARM_UP_COMMANDS:
            return True
        return time.monotonic() - command.commanded_at_s <= self._max_age_s

    def _fall_silent(self, command: DeviceCommand | None) -> None:
        """Send zeros once more, then nothing: the device's watchdog has the last word."""
        self._silent = True
        text = f"no command for {self._max_age_s * 1e3:.0f} ms: the loop stood still; zeros sent"
        if self._connected:
            self._connected = False
            try:
                self._device.vent(time.monotonic())
            except HardwareError as error:
                text += f", which failed: {error}"
        self._link.say(LinkState.SILENT, time.monotonic(), text)

    def _connect(self) -> None:
        """Connect, vented; it regulates only after a new order to vent: nothing re-arms itself."""
        now_s = time.monotonic()
        if now_s < self._retry_s:
            time.sleep(_IDLE_S)
            return
        self._link.say(LinkState.STARTING, now_s)
        self._may_regulate = False
        try:
            self._device.close()
            self._device.connect()
            self._vent()
            self._measure()
        except HardwareError as error:
            self._lose(error)
            return
        self._connected = True

    def _exchange(self, command: DeviceCommand | None) -> None:
        """Write and read; after a longer pause read first: the device may not be as it was."""
        try:
            if time.clock_gettime(_GAP_CLOCK) - self._exchanged_s > self._look_first_s:
                self._measure()
            self._write(command)
            self._measure()
        except HardwareError as error:
            self._lose(error)

    def _note_gap(self) -> None:
        """Raise HardwareError where the device was not talked to for half of its watchdog's time.

        Called before and after each call: this process may be stopped in the middle of one. While
        nothing but zeros has been sent there is nothing that could come back.
        """
        now_s = time.clock_gettime(_GAP_CLOCK)
        gap_s, self._exchanged_s = now_s - self._exchanged_s, now_s
        if gap_s > self._gap_max_s and self._device.sent_pa.any():
            raise HardwareError(
                f"the device was not talked to for {1e3 * gap_s:.0f} ms (allowed: "
                f"{1e3 * self._gap_max_s:.0f} ms): its process stood still, the machine slept, or "
                "the device answers too slowly, and it may have vented by itself; end what keeps "
                "the machine busy, then reset"
            )

    def _vent(self) -> None:
        """Send zeros."""
        self._device.vent(time.monotonic())
        self._exchanged_s = time.clock_gettime(_GAP_CLOCK)

    def _write(self, command: DeviceCommand | None) -> None:
        warm = command is not None and command.sequence > WARM_UP_COMMANDS
        self._may_regulate |= warm and command is not None and command.order == Order.VENT
        regulates = self._may_regulate and self._parent_gone_s is None
        if command is None or not warm or not regulates or command.order == Order.VENT:
            self._vent()
        else:
            self._note_gap()
            now_s = time.monotonic()
            guarded = self._device.write(command.pressures_pa, command.commanded_at_s, now_s)
            self._note_gap()
            self._device.acknowledged(time.monotonic())
            self._link.intervened(guarded.intervention)
        self._link.sent(self._device.sent_pa)

    def _measure(self) -> None:
        self._note_gap()
        measurement = self._device.read(time.monotonic())
        self._note_gap()
        now_s = time.monotonic()
        self._link.measured(measurement, now_s, now_s)

    def _lose(self, error: HardwareError) -> None:
        """Tell it, and try again: at once the first time, so that the outputs go to zero."""
        self._retry_s = 0.0 if self._connected else time.monotonic() + _RETRY_S
        self._connected = False
        self._link.say(LinkState.LOST, time.monotonic(), str(error))

    def _is_over(self) -> bool:
        """The end: on the supervisor's word, or after it is gone and control has fallen silent."""
        now_s = time.monotonic()
        if parent_is_alive():
            return self._end.poll()
        if self._parent_gone_s is None:
            self._parent_gone_s = now_s
        return self._silent or now_s - self._parent_gone_s > _VENT_BEFORE_END_S

    def _let_go(self) -> None:
        """Vent and close; what fails here has failed before, and was told."""
        try:
            if self._connected:
                self._device.vent(time.monotonic())
        except HardwareError:
            pass  # its watchdog has to do it
        finally:
            self._device.close()


def main(shared: Shared, arm_lock: Lock, device_lock: Lock, end: Connection) -> None:
    """Entry point of the process; the locks are held here too, as in control."""
    ignore_terminal_signals()
    # Right below the loop: a command that waits for a processor gets old.
    realtime.take_priority(max(1, shared.configuration.control.priority - 1))
    if shared.device is not None:
        DeviceProcess(shared.configuration, shared.device, end).run()

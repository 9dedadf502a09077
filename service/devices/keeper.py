"""The supervisor's hand on the device process: its start, its silence, zeros in its place."""

import time
from collections.abc import Callable

from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.interface import Hardware
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.devices import registry as backends
from pneuarm.service.processes.child import Child
from pneuarm.service.processes.device_slots import DeviceLink, DeviceWatch, LinkState

#: A device process that has said nothing for this long (s) is stuck; connecting may take longer.
_STUCK_S = 0.5
_STUCK_CONNECTING_S = 60.0
_START_S = 40.0


class DeviceKeeper:
    """Starts the device process, sees that it lives, and can zero the device without it."""

    def __init__(self, configuration: Configuration, link: DeviceLink, child: Child) -> None:
        self._child, self._watch = child, DeviceWatch(link)
        # Made now: in an emergency nothing should have to be loaded.
        self._spare: Hardware = backends.build(configuration, configuration.build_arm())
        self._zeroed = False

    def start(self, give_up: Callable[[], bool]) -> None:
        """Start it and wait for its device; raises HardwareError where that does not answer."""
        self._child.start()
        until_s = time.monotonic() + _START_S
        while not give_up() and time.monotonic() < until_s:
            standing = self._watch.standing()
            if standing is not None and standing.state == LinkState.CONNECTED:
                return
            if standing is not None and standing.state == LinkState.LOST:
                raise HardwareError(standing.text)
            if not self._child.is_alive():
                raise HardwareError("the device process ended at its start; see its line above")
            time.sleep(0.01)

    def look_after(self) -> str:
        """Zero the device once if its process is dead or stuck; return what went wrong then."""
        if self._child.is_alive() and not self._is_stuck():
            self._zeroed = False
            return ""
        if self._zeroed:
            return ""
        return self.zero()

    def _is_stuck(self) -> bool:
        now_s = time.monotonic()  # before: stopped in between, this process would blame the other
        standing = self._watch.standing()
        if standing is None or standing.state == LinkState.SILENT:
            return False
        connecting = standing.state in (LinkState.STARTING, LinkState.LOST)
        age_s = now_s - standing.published_s
        return age_s > (_STUCK_CONNECTING_S if connecting else _STUCK_S)

    def zero(self) -> str:
        """Kill the process and zero the device from here; return an empty string, or why not."""
        self._child.kill()
        self._zeroed = True
        try:
            self._spare.connect()
            self._spare.vent(time.monotonic())
        except HardwareError as error:
            return str(error)
        finally:
            self._spare.close()
        return ""

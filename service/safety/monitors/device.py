"""What the device says by itself: complaints, and its stop input."""

from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.monitor import Observation


class Complaints:
    """The device's own diagnostics, passed on as they are."""

    code = FaultCode.DEVICE_COMPLAINS

    def look(self, seen: Observation) -> str:
        """Return the complaints."""
        return "; ".join(seen.complaints)


class StopInput:
    """The stop button at the device; it acts in the tick that reads it."""

    code = FaultCode.STOP_PRESSED

    def look(self, seen: Observation) -> str:
        """Tell that it is pressed."""
        return "the stop input of the device is pressed" if seen.stop_pressed else ""

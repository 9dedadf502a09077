"""What the device says by itself: complaints, and its stop input."""

from pneuarm.service.monitors.fault import Fault, Policy
from pneuarm.service.monitors.monitor import Monitor, Observation


class DeviceComplains(Monitor):
    """The device's own diagnostics, passed on as they are."""

    fault = Fault(
        "device_complains",
        13,
        Policy.WARN,
        "the device reports something by itself",
        "see the device's manual for what it says",
    )
    looks_at = "what the device reports by itself"
    how_to_set = "no threshold"
    needs_fresh = False

    def look(self, seen: Observation) -> str:
        """Return the complaints."""
        return "; ".join(seen.complaints)


class StopPressed(Monitor):
    """The stop button at the device; it acts in the tick that reads it."""

    fault = Fault(
        "stop_pressed",
        14,
        Policy.STOP,
        "the stop input of the device is pressed",
        "release the stop button, then reset and enable",
    )
    looks_at = "the device's stop input"
    how_to_set = "no threshold"
    needs_fresh = False

    def look(self, seen: Observation) -> str:
        """Tell that it is pressed."""
        return "the stop input of the device is pressed" if seen.stop_pressed else ""

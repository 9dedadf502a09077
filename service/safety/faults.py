"""Every fault in one table: those that the monitors look for, and that of a failed tick.

`make docs` writes the table of docs/safety.md from this one.
"""

from pneuarm.service.monitors.fault import Fault, Policy
from pneuarm.service.monitors.monitors import MONITORS

TICK_FAILED = Fault(
    "tick_failed",
    0,
    Policy.VENT,
    "a tick of the loop failed: a mistake in the program",
    "reset; report it with the log if it comes again",
)

#: Every fault by its code, in the order of the bits.
FAULTS: dict[str, Fault] = {
    fault.code: fault
    for fault in sorted(
        (TICK_FAILED, *(monitor.fault for monitor in MONITORS)), key=lambda fault: fault.bit
    )
}

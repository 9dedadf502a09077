"""Every fault in one table: what it means, what the arm does about it, and what to do then.

`make docs` writes the table of docs/safety.md from this one.
"""

from dataclasses import dataclass
from enum import IntEnum

from pneuarm.service.modes.mode import ModeEvent


class Policy(IntEnum):
    """What the arm does about a fault, the mildest first."""

    WARN = 0  # an event, and nothing else
    HOLD = 1  # mode hold; enabling is refused until the cause is gone
    RAMP = 2  # mode fault, latched; the pressures ramp to zero, then the arm vents
    VENT = 3  # mode fault, latched; vented at once
    STOP = 4  # mode estop, latched; vented at once


class FaultCode(IntEnum):
    """The faults; the number is the bit in ``ArmState.active_faults``, the name is the code."""

    TICK_FAILED = 0
    DEVICE_LOST = 1
    MEASUREMENT_OLD = 2
    SENSOR_INVALID = 3
    SENSOR_FROZEN = 4
    OVERPRESSURE = 5
    PRESSURE_DEVIATES = 6
    LEAK = 7
    SUPPLY_LOW = 8
    MODEL_CONTRADICTED = 9
    ESTIMATE_DIVERGES = 10
    LOOP_OVERRUNS = 11
    SETPOINT_FOREIGN = 12
    DEVICE_COMPLAINS = 13
    STOP_PRESSED = 14


#: What follows from each policy: the mode event, and the consequence in words.
EVENTS: dict[Policy, ModeEvent | None] = {
    Policy.WARN: None,
    Policy.HOLD: ModeEvent.FAULT_HOLD,
    Policy.RAMP: ModeEvent.FAULT,
    Policy.VENT: ModeEvent.FAULT,
    Policy.STOP: ModeEvent.ESTOP,
}
CONSEQUENCES: dict[Policy, str] = {
    Policy.WARN: "the arm goes on",
    Policy.HOLD: "the arm holds, and enabling is refused until the cause is gone",
    Policy.RAMP: "the pressures ramp to zero, and the fault stays until reset",
    Policy.VENT: "the arm vents at once, and the fault stays until reset",
    Policy.STOP: "the arm vents at once, and the stop stays until reset",
}


@dataclass(frozen=True)
class Fault:
    """One row of the table; ``cause`` is what the fault usually comes from."""

    policy: Policy
    cause: str
    remedy: str

    @property
    def consequence(self) -> str:
        """What the arm does about it."""
        return CONSEQUENCES[self.policy]


FAULTS: dict[FaultCode, Fault] = {
    FaultCode.TICK_FAILED: Fault(
        Policy.VENT,
        "a tick of the loop failed: a mistake in the program",
        "reset; report it with the log if it comes again",
    ),
    FaultCode.DEVICE_LOST: Fault(
        Policy.VENT,
        "the device does not answer: its cable, its power or its address",
        "see that the device has power and is connected, then reset",
    ),
    FaultCode.MEASUREMENT_OLD: Fault(
        Policy.HOLD,
        "the device answers too late: a busy bus or network",
        "take other traffic off the bus, or allow monitors.measurement_age_ms; then enable again",
    ),
    FaultCode.SENSOR_INVALID: Fault(
        Policy.RAMP,
        "a pressure sensor reads nonsense: a broken wire or a dead sensor",
        "look at the sensor of the chamber that the event names, then reset",
    ),
    FaultCode.SENSOR_FROZEN: Fault(
        Policy.RAMP,
        "a pressure reading stands still while its command moves: a dead sensor or a stuck valve",
        "look at the sensor and the valve of the chamber that the event names, then reset",
    ),
    FaultCode.OVERPRESSURE: Fault(
        Policy.VENT,
        "a chamber is above its highest pressure and may burst: its valve or its calibration",
        "look at the valve of the chamber that the event names, and at the chamber, then reset",
    ),
    FaultCode.PRESSURE_DEVIATES: Fault(
        Policy.RAMP,
        "a pressure does not follow its command: a stuck valve, a kinked, loose or burst tube",
        "look at the valve and the tube of the chamber that the event names, then reset",
    ),
    FaultCode.LEAK: Fault(
        Policy.RAMP,
        "a held pressure falls: a leak",
        "find the leak of the chamber that the event names (soapy water shows it), then reset",
    ),
    FaultCode.SUPPLY_LOW: Fault(
        Policy.HOLD,
        "the supply pressure is too low: the compressor or its regulator",
        "restore the supply, then enable again",
    ),
    FaultCode.MODEL_CONTRADICTED: Fault(
        Policy.HOLD,
        "measured lengths or tip pose contradict the model: a slipped sensor or marker, a wrong "
        "frame, a burst chamber, something in the arm's way",
        "look at the arm and at what measures it, then enable again",
    ),
    FaultCode.ESTIMATE_DIVERGES: Fault(
        Policy.HOLD,
        "the estimated lengths are impossible: a sensor or its calibration",
        "compare the state's lengths with the arm, then enable again",
    ),
    FaultCode.LOOP_OVERRUNS: Fault(
        Policy.WARN,
        "the loop misses deadlines: the machine is too busy or the rate too high",
        "run `pneuarm doctor`; end other programs, or lower control.rate_hz",
    ),
    FaultCode.SETPOINT_FOREIGN: Fault(
        Policy.VENT,
        "the device has setpoints that are not ours: another program commands it too",
        "end the other program, or the device's own panel, then reset",
    ),
    FaultCode.DEVICE_COMPLAINS: Fault(
        Policy.WARN,
        "the device reports something by itself",
        "see the device's manual for what it says",
    ),
    FaultCode.STOP_PRESSED: Fault(
        Policy.STOP,
        "the stop input of the device is pressed",
        "release the stop button, then reset and enable",
    ),
}

"""The table of faults: what old logs say stays readable, and every fault says what to do."""

from pneuarm.service.monitors.fault import Policy
from pneuarm.service.monitors.monitors import MONITORS
from pneuarm.service.safety.faults import FAULTS, TICK_FAILED

#: Bit and policy of every fault that stands in a recorded session somewhere: none ever changes.
RECORDED = {
    "tick_failed": (0, Policy.VENT),
    "device_lost": (1, Policy.VENT),
    "measurement_old": (2, Policy.HOLD),
    "sensor_invalid": (3, Policy.RAMP),
    "sensor_frozen": (4, Policy.RAMP),
    "overpressure": (5, Policy.VENT),
    "pressure_deviates": (6, Policy.RAMP),
    "leak": (7, Policy.RAMP),
    "supply_low": (8, Policy.HOLD),
    "model_contradicted": (9, Policy.HOLD),
    "estimate_diverges": (10, Policy.HOLD),
    "loop_overruns": (11, Policy.WARN),
    "setpoint_foreign": (12, Policy.VENT),
    "device_complains": (13, Policy.WARN),
    "stop_pressed": (14, Policy.STOP),
}


def test_no_code_bit_or_policy_of_a_recorded_fault_changes() -> None:
    now = {code: (fault.bit, fault.policy) for code, fault in FAULTS.items()}
    assert RECORDED.items() <= now.items()


def test_every_fault_has_a_code_and_a_bit_of_its_own() -> None:
    faults = [TICK_FAILED, *(monitor.fault for monitor in MONITORS)]
    assert len({fault.code for fault in faults}) == len(faults)
    assert len({fault.bit for fault in faults}) == len(faults)
    assert all(0 <= fault.bit < 32 for fault in faults)  # of a uint32
    bits = [fault.bit for fault in FAULTS.values()]
    assert bits == sorted(bits)


def test_every_policy_is_used_and_every_fault_says_what_to_do() -> None:
    assert {fault.policy for fault in FAULTS.values()} == set(Policy)
    for fault in FAULTS.values():
        assert fault.cause
        assert fault.remedy
        assert "\n" not in fault.cause + fault.remedy

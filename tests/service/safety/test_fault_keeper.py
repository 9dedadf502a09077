"""Which faults are there, when they are told, and what they forbid."""

import pytest

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.modes.mode import Mode, ModeEvent, next_mode
from pneuarm.service.modes.mode_keeper import ModeKeeper
from pneuarm.service.monitors.fault import Fault, Policy
from pneuarm.service.safety.fault_keeper import FaultKeeper
from pneuarm.service.safety.faults import FAULTS
from tests.service.modes.test_mode_keeper import TIMEOUTS

each_fault = pytest.mark.parametrize("fault", FAULTS.values(), ids=lambda fault: fault.code)
LEAK, SUPPLY_LOW, OVERPRESSURE = (FAULTS[code] for code in ("leak", "supply_low", "overpressure"))
DEVICE_LOST, TICK_FAILED = FAULTS["device_lost"], FAULTS["tick_failed"]
AFTER_POLICY = {
    #               idle    ready   active  hold    fault   estop
    Policy.WARN: "IDLE   READY   ACTIVE  HOLD    FAULT   ESTOP",
    Policy.HOLD: "IDLE   READY   HOLD    HOLD    FAULT   ESTOP",
    Policy.RAMP: "FAULT  FAULT   FAULT   FAULT   FAULT   ESTOP",
    Policy.VENT: "FAULT  FAULT   FAULT   FAULT   FAULT   ESTOP",
    Policy.STOP: "ESTOP  ESTOP   ESTOP   ESTOP   ESTOP   ESTOP",
}


class Kept:
    """A keeper of faults, in a mode, with what it tells."""

    def __init__(self, mode: Mode = Mode.ACTIVE) -> None:
        self.events: list[pb.Event] = []
        self.modes = ModeKeeper(TIMEOUTS, self.events.append)
        self.modes.mode = mode
        self.faults = FaultKeeper(self.modes)

    def codes(self) -> list[str]:
        return [event.code for event in self.events]


@pytest.mark.parametrize("mode", Mode)
@each_fault
def test_every_fault_in_every_mode_does_what_its_policy_says_and_is_told_once(
    fault: Fault, mode: Mode
) -> None:
    kept = Kept(mode)
    for now_s in (0.0, 0.1, 0.2):
        kept.faults.seen({fault: "seen"}, now_s)
    expected = AFTER_POLICY[fault.policy].split()[mode - 1]
    assert kept.modes.mode == Mode[expected]
    (told,) = kept.events
    assert (told.code, told.cause, told.remedy) == (fault.code, "seen", fault.remedy)
    assert fault.cause in told.text
    assert fault.policy.consequence in told.text
    assert told.level == (pb.ERROR if fault.policy >= Policy.RAMP else pb.WARNING)
    assert told.mode == kept.modes.mode
    assert kept.faults.bits == 1 << fault.bit


def test_every_policy_has_an_event_and_a_consequence() -> None:
    for policy in Policy:
        assert policy.consequence
        assert (policy.event is None) == (policy == Policy.WARN)
        if policy.event is not None:
            assert next_mode(Mode.ACTIVE, policy.event) not in (None, Mode.ACTIVE), policy


def test_what_is_no_longer_seen_is_gone_but_stays_latched() -> None:
    kept = Kept()
    kept.faults.seen({LEAK: "x"}, 0.0)
    kept.faults.seen({}, 0.1)
    assert (kept.faults.active, kept.faults.bits, kept.modes.mode) == ({}, 0, Mode.FAULT)
    assert kept.faults.why_not(ModeEvent.RESET) == ""


def test_a_failed_call_is_there_until_a_whole_tick_works() -> None:
    kept = Kept()
    kept.faults.failed(DEVICE_LOST, "no answer", 0.0)
    kept.faults.seen({}, 0.1)
    assert list(kept.faults.active) == [DEVICE_LOST]
    kept.faults.worked()
    assert kept.faults.active == {}
    kept.faults.failed(DEVICE_LOST, "no answer", 1.0)
    kept.faults.failed(TICK_FAILED, "something else", 1.1)
    assert list(kept.faults.active) == [TICK_FAILED]


@each_fault
def test_only_a_warning_forbids_nothing(fault: Fault) -> None:
    kept = Kept()
    kept.faults.seen({fault: "so much"}, 0.0)
    for event in (ModeEvent.ENABLE, ModeEvent.RESET):
        reason = kept.faults.why_not(event)
        if fault.policy == Policy.WARN:
            assert reason == ""
        else:
            assert all(told in reason for told in (fault.code, "so much", fault.remedy))
    for event in (ModeEvent.HOLD, ModeEvent.VENT, ModeEvent.ESTOP):
        assert kept.faults.why_not(event) == ""


def test_a_warning_is_told_again_only_after_its_time_however_it_flickers() -> None:
    kept = Kept()
    for number in range(2001):
        found = {FAULTS["loop_overruns"]: "late"} if number % 2 == 0 else {}
        kept.faults.seen(found, number * 0.01)
    assert kept.codes() == ["loop_overruns"] * 3


@each_fault
def test_what_lasts_is_told_once_and_a_warning_every_ten_seconds(fault: Fault) -> None:
    kept, failing = Kept(), Kept()
    for number in range(251):
        kept.faults.seen({fault: "so"}, number * 0.1)
        failing.faults.failed(fault, "so", number * 0.1)
    times = 3 if fault.policy == Policy.WARN else 1
    assert kept.codes() == failing.codes() == [fault.code] * times


def test_what_has_failed_and_is_seen_too_is_one_fault() -> None:
    kept = Kept()
    kept.faults.failed(DEVICE_LOST, "no answer", 0.0)
    assert kept.faults.bits == 1 << DEVICE_LOST.bit
    kept.faults.seen({DEVICE_LOST: "too old"}, 11.0)
    assert kept.codes() == ["device_lost"]
    assert kept.faults.bits == 1 << DEVICE_LOST.bit
    kept.faults.seen({LEAK: "a", SUPPLY_LOW: "b"}, 11.1)
    assert kept.faults.bits == 1 << DEVICE_LOST.bit | 1 << LEAK.bit | 1 << SUPPLY_LOW.bit


def test_a_fault_that_comes_back_within_its_time_is_not_told_again() -> None:
    kept = Kept()
    for now_s, found in ((0.0, {SUPPLY_LOW: "a"}), (0.5, {}), (1.0, {SUPPLY_LOW: "b"}), (2.0, {})):
        kept.faults.seen(found, now_s)
    assert kept.modes.mode == Mode.HOLD
    assert kept.codes() == ["supply_low"]
    kept.faults.seen({SUPPLY_LOW: "c"}, 10.0)
    assert kept.codes() == ["supply_low"] * 2


def test_another_fault_in_a_latched_mode_is_told_too() -> None:
    kept = Kept()
    kept.faults.seen({LEAK: "a"}, 0.0)
    kept.faults.seen({LEAK: "a", SUPPLY_LOW: "b"}, 0.1)
    kept.faults.failed(DEVICE_LOST, "c", 0.2)
    assert kept.codes() == ["leak", "supply_low", "device_lost"]


def test_after_a_reset_the_same_fault_is_told_and_acts_at_once() -> None:
    kept = Kept()
    kept.faults.seen({LEAK: "a"}, 0.0)
    kept.faults.seen({}, 0.1)
    kept.modes.request(ModeEvent.RESET, 0.2, "me")
    kept.faults.seen({LEAK: "a"}, 0.3)
    assert kept.modes.mode == Mode.FAULT
    assert kept.codes() == ["leak", "reset", "leak"]


def test_a_ramp_is_asked_for_by_faults_that_ramp_and_by_none_that_is_worse() -> None:
    kept = Kept()
    assert not kept.faults.ramps()
    kept.faults.seen({LEAK: "a", SUPPLY_LOW: "b"}, 0.0)
    assert (kept.faults.ramps(), kept.faults.vents()) == (True, False)
    kept.faults.seen({LEAK: "a", OVERPRESSURE: "b"}, 0.1)
    assert (kept.faults.ramps(), kept.faults.vents()) == (False, True)

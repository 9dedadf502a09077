"""The arm is broken in every way, while it moves: the fault is found, named, and acted upon."""

import pytest

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.modes.mode import Mode
from pneuarm.service.monitors.fault import Policy
from pneuarm.service.safety.faults import FAULTS
from tools.faults.breakages import (
    BREAKAGES,
    DEVICES,
    PRESETS,
    bench_of,
    detection_s,
    false_alarms,
    follow,
)

MODES = {
    Policy.WARN: Mode.ACTIVE,
    Policy.HOLD: Mode.HOLD,
    Policy.RAMP: Mode.FAULT,
    Policy.VENT: Mode.FAULT,
    Policy.STOP: Mode.ESTOP,
}


def test_every_fault_is_provoked() -> None:
    assert {breakage.code for breakage in BREAKAGES.values()} == set(FAULTS)


@pytest.mark.parametrize("name", BREAKAGES)
def test_what_breaks_is_found_and_its_policy_carried_out(name: str) -> None:
    code = BREAKAGES[name].code
    seconds, bench = detection_s("paper", 3, name)
    assert seconds < 1.5
    told = next(event for event in bench.events if event.code == code)
    fault = FAULTS[code]
    assert bench.mode == told.mode == MODES[fault.policy]
    assert (told.text, told.remedy) == (f"{fault.cause}; {fault.policy.consequence}", fault.remedy)
    assert told.cause
    assert told.level == (pb.ERROR if fault.policy >= Policy.RAMP else pb.WARNING)
    assert int(bench.newest["active_faults"]) & (1 << fault.bit)
    bench.run(2.0)
    assert [event.code for event in bench.events].count(told.code) == 1


@pytest.mark.parametrize(("preset", "device"), list(zip(PRESETS, DEVICES, strict=True)))
def test_the_fastest_legal_moves_raise_nothing(preset: str, device: dict[str, object]) -> None:
    assert false_alarms(preset, 5, 4.0, **device) == []


def test_what_the_device_says_is_written_down() -> None:
    bench, _ = bench_of("paper", 0, rate_hz=50.0)
    bench.activate()
    follow(bench, 0.5)
    ticks = bench.ticks()[-50:]
    assert (ticks["supply_pa"] == 2e5).all()
    ages = ticks["measurement_age_s"]
    assert ages.min() == pytest.approx(0.0)
    assert 0.012 < ages.max() < 0.02
    assert not ticks["active_faults"].any()

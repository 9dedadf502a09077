"""Safety without the loop: what a fault does to the ramp down, and what forbids a reset."""

from dataclasses import replace

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.interface import Measurement
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.tables.monitors import MonitorsConfig
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.modes.mode_keeper import ModeKeeper
from pneuarm.service.processes.pipe import SetTipPose
from pneuarm.service.safety.faults import FAULTS
from pneuarm.service.safety.safety import Safety
from tests.service.modes.test_mode_keeper import TIMEOUTS
from tools.rig.arms import paper_arm, trunk_arm

DT_S = 0.01
SENT_PA = np.array([[5e4, 2e4, -1e4]])
IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])


class Rig:
    """An arm that holds pressures, and safety that looks at it."""

    def __init__(self, arm: Arm | None = None, ramp_bar_s: float = 1.0) -> None:
        self.arm = arm or paper_arm()
        self.events: list[pb.Event] = []
        self.modes = ModeKeeper(TIMEOUTS, self.events.append)
        self.modes.mode = Mode.ACTIVE
        self.safety = Safety(self.arm, MonitorsConfig(ramp_bar_s=ramp_bar_s), self.modes)
        self.ticks, self.tip = 1000, None
        self.pressures_pa: Array = SENT_PA
        self.stop_pressed = False
        self.overruns = 0

    @property
    def now_s(self) -> float:
        return self.ticks * DT_S

    def look(self, count: int = 1) -> None:
        for _ in range(count):
            self.ticks += 1
            now_ns = self.ticks * 10_000_000
            tip = None if self.tip is None else SetTipPose(self.tip, IDENTITY, now_ns)
            measured = Measurement(
                self.pressures_pa,
                np.full((1, 3), np.nan),
                taken_s=self.now_s,
                stop_pressed=self.stop_pressed,
            )
            rest_m = self.arm.rest_lengths_m
            self.safety.look(measured, SENT_PA, rest_m, tip, self.overruns, now_ns, DT_S)

    def ramping(self) -> "Rig":
        """Its sensor breaks, and the pressures begin to ramp down."""
        self.look()
        self.pressures_pa = np.array([[np.nan, 2e4, -1e4]])
        while self.modes.mode == Mode.ACTIVE:
            self.look()
        return self

    @property
    def down_pa(self) -> Array | None:
        return self.safety.ramping_pa(self.now_s)

    def why_not(self, event: ModeEvent) -> str:
        return self.safety.why_not(event, self.now_s)


def test_a_fault_comes_after_its_time_and_the_ramp_starts_from_what_was_sent() -> None:
    rig = Rig()
    assert (rig.safety.bits, rig.down_pa) == (0, None)
    rig.look()
    begun = rig.ticks
    rig.ramping()
    assert 5 <= rig.ticks - begun <= 8  # 50 ms, and the tick in which all was well
    assert rig.safety.bits == 1 << FAULTS["sensor_invalid"].bit
    np.testing.assert_array_equal(rig.down_pa, SENT_PA)
    rig.look(25)  # 1 bar/s for 0.5 bar: half of the way
    np.testing.assert_allclose(rig.down_pa, 0.5 * SENT_PA, rtol=1e-6)
    rig.look(24)
    assert rig.down_pa is not None
    rig.look(2)
    assert rig.down_pa is None
    rig.look(100)
    assert rig.down_pa is None
    assert rig.modes.mode == Mode.FAULT


@pytest.mark.parametrize(("ramp_bar_s", "ticks"), [(0.5, 100), (2.0, 50)])
def test_the_ramp_is_as_fast_as_asked_for_and_as_the_slowest_chamber(
    ramp_bar_s: float, ticks: int
) -> None:
    fast = replace(trunk_arm().sections[0], pressure_slew_max_pa_s=9e5)
    slow = replace(fast, pressure_slew_max_pa_s=1e5)
    safety = Safety(
        replace(trunk_arm(), sections=(fast, slow)),
        MonitorsConfig(ramp_bar_s=ramp_bar_s),
        ModeKeeper(TIMEOUTS, lambda event: None),
    )
    assert safety._ramp_pa_s == min(ramp_bar_s * 1e5, 1e5)
    one = replace(paper_arm().sections[0], pressure_slew_max_pa_s=1e5)
    rig = Rig(replace(paper_arm(), sections=(one,)), ramp_bar_s).ramping()
    rig.look(ticks - 1)
    assert rig.down_pa is not None
    rig.look(2)
    assert rig.down_pa is None


def test_a_fault_that_vents_cuts_the_ramp_short_or_begins_none() -> None:
    rig = Rig().ramping()
    rig.pressures_pa = np.array([[2e5, 2e4, -1e4]])
    rig.look(4)
    assert rig.safety.bits & 1 << FAULTS["overpressure"].bit
    assert rig.down_pa is None
    rig = Rig()
    rig.pressures_pa = np.array([[1.2e5, 2e4, -1e4]])
    rig.look(4)
    assert rig.modes.mode == Mode.FAULT
    assert rig.down_pa is None


def test_a_stop_ends_the_ramp_at_once_and_for_ever() -> None:
    rig = Rig().ramping()
    rig.modes.request(ModeEvent.ESTOP, rig.now_s, "me")
    assert rig.down_pa is None
    rig.pressures_pa = SENT_PA
    rig.look()
    assert rig.why_not(ModeEvent.RESET) == ""
    rig.modes.request(ModeEvent.RESET, rig.now_s, "me")
    rig.modes.mode = Mode.FAULT  # by something else than a fault that is there
    assert rig.down_pa is None


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (HardwareError("no answer"), "device_lost"),
        (OSError("unplugged"), "device_lost"),
        (ValueError("a mistake"), "tick_failed"),
    ],
)
def test_a_failure_ends_the_ramp_and_is_there_until_a_tick_works(
    error: Exception, code: str
) -> None:
    rig = Rig().ramping()
    rig.safety.failed(error, "the cause", rig.now_s)
    assert rig.down_pa is None
    assert (rig.events[-1].code, rig.events[-1].cause) == (code, "the cause")
    rig.pressures_pa = SENT_PA
    rig.look()
    assert rig.safety.bits == 1 << FAULTS[code].bit
    assert code in rig.why_not(ModeEvent.RESET)
    rig.safety.worked()
    assert rig.safety.bits == 0
    assert rig.why_not(ModeEvent.RESET) == ""


def test_a_reset_waits_for_the_ramp_and_enabling_names_the_fault() -> None:
    rig = Rig().ramping()
    assert all(fact in rig.why_not(ModeEvent.RESET) for fact in ("ramp", "zero"))
    assert "sensor_invalid" in rig.why_not(ModeEvent.ENABLE)
    rig.pressures_pa = SENT_PA
    rig.look()
    assert "ramp" in rig.why_not(ModeEvent.RESET)
    assert rig.why_not(ModeEvent.ENABLE) == ""
    rig.look(60)
    assert rig.why_not(ModeEvent.RESET) == ""


def test_a_measured_tip_far_from_the_model_is_told_after_half_a_second() -> None:
    rig = Rig()
    rig.tip = np.array([0.0, 0.0, 0.2])
    rig.look(100)
    assert rig.modes.mode == Mode.ACTIVE
    rig.tip = np.array([2.0, 0.0, 0.2])
    rig.look(45)
    assert rig.modes.mode == Mode.ACTIVE
    rig.look(10)
    assert (rig.modes.mode, rig.events[-1].code) == (Mode.HOLD, "model_contradicted")
    rig.tip = None
    rig.look()
    assert rig.safety.bits == 0


def test_the_stop_input_and_the_overruns_reach_the_monitors() -> None:
    rig = Rig()
    for _ in range(102):
        rig.look()
        rig.overruns += 1
    assert rig.events[-1].code == "loop_overruns"
    rig.stop_pressed = True
    rig.look()
    assert (rig.modes.mode, rig.events[-1].code) == (Mode.ESTOP, "stop_pressed")

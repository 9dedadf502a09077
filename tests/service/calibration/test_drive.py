"""The motion as a client sends it, on the loop and a clock in simulated time."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pneuarm.controllers.calibration.pace import Pace
from pneuarm.controllers.calibration.plan import Move
from pneuarm.controllers.targets.targets import PressuresTarget
from pneuarm.logs.rings.tick import state_from_tick
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.calibration import drive, simulated
from pneuarm.service.calibration.motion import first_moves, pace_after
from pneuarm.service.modes.mode import ModeEvent
from pneuarm.service.processes.pipe import RequestMode, SetTarget
from tools.bench.responses import arm_of

TICK_S = 0.004


class SimulatedClient:
    """What `drive` asks of a client and of a clock; every sleep is a tick of the loop."""

    arm = "paper"

    def __init__(self, row: str) -> None:
        self.configuration, device = arm_of(row, "paper", 0)
        self._run = simulated._Run(self.configuration, device)
        self.now_s, self._target = 0.0, np.zeros(0)
        self._rest()

    def _rest(self) -> None:
        for _ in range(round(1.0 / TICK_S)):
            self._newest = self._run.tick()

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.now_s += TICK_S
        given, received_ns = [], self._run.now_ns + simulated._PERIOD_NS
        if self._target.size:
            target = PressuresTarget(self._target)
            given = [SetTarget(target, self._run.ticks, received_ns)]
            self._target = np.zeros(0)
        self._newest = self._run.tick(*given)

    def state(self) -> pb.ArmState:
        state = state_from_tick(self._newest)
        tip = self._newest["tip_true_position_m"].tolist()
        state.ClearField("tip_measured_position_m")
        state.tip_measured_position_m.extend(tip)
        state.tip_measured_age_s = 0.0
        return state

    def _ask(self, event: ModeEvent) -> None:
        self._newest = self._run.tick(RequestMode(event, 2, "calibrate"))

    def enable(self) -> None:
        self._ask(ModeEvent.ENABLE)

    def hold(self) -> None:
        self._ask(ModeEvent.HOLD)

    def vent(self) -> None:
        self._ask(ModeEvent.VENT)
        self._rest()

    def events(self) -> list[pb.Event]:
        return []

    def send_pressures(self, pressures_pa: list[float]) -> None:
        self._target = np.array(pressures_pa).reshape(1, 3)


def test_gentle_steps_are_steps_and_what_begins_elsewhere_is_approached_at_its_pace(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    client: Any = SimulatedClient("60/60/5")
    clock = SimpleNamespace(monotonic=client.monotonic, sleep=client.sleep)
    monkeypatch.setattr(drive, "time", clock)
    so_far, configuration = drive.Progressed(), client.configuration
    first, slowly = first_moves(configuration)
    drive.record(client, first, configuration, lambda *_: None, so_far=so_far, pace=slowly)
    assert so_far.moves_done == len(first)
    assert client.now_s < 20.0
    pace_after(configuration, so_far.recording)
    # The next move began at 0.4 bar in the plan; the arm is vented.
    there = np.full((1, 3), 4e4)
    moves = [*first[:-1], Move(there, 0.7, 0.5), Move(1.2 * there, 0.7, 0.5)]
    so_far.moves_done, begun_s = len(first), client.now_s
    drive.record(
        client, moves, configuration, lambda *_: None, so_far=so_far, pace=Pace(1.2e4, 1.2e4)
    )
    assert client.now_s - begun_s > 4.0
    assert np.ptp(so_far.recording.sent_pa) == pytest.approx(4.8e4, rel=0.05)

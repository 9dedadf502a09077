"""One trial as a client drives it: every begin alike, and every end that is none of its own."""

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

from pneuarm.controllers.arm.errors import DaemonUnreachable, LearningError, ModeRefused, TrialLost
from pneuarm.controllers.learning.course import Course
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.calibration import drive as calibration_drive
from pneuarm.service.configuration.configuration import load
from pneuarm.service.learning import drive
from tests.controllers.learning.plants import bow

COURSE = Course(bow(2.0))
STEP_S = 0.01


class FakeClient:
    """A daemon that takes every target at once, on time that is only counted."""

    arm = "paper"

    def __init__(self) -> None:
        self.now_s = 100.0
        self.sent: list[pb.Target] = []
        self.sent_s: list[float] = []
        self.takes = True
        self.mode, self.reach, self.limits = pb.ACTIVE, pb.REACHED, 0
        self.reached_at_s = 0.0
        self.told: list[pb.Event] = []
        self.tip_age_s = 0.01
        self.dies_at_s = np.inf

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.now_s += max(seconds, STEP_S)

    def send(self, target: pb.Target) -> int:
        self.sent.append(target)
        self.sent_s.append(self.now_s)
        return len(self.sent)

    def raise_if_refused(self, first: int) -> None:
        pass

    def events(self) -> list[pb.Event]:
        told, self.told = self.told, []
        return told

    def state(self) -> pb.ArmState:
        if self.now_s > self.dies_at_s:
            raise DaemonUnreachable("no state of arm 'paper' for 2 s")
        reach = self.reach if self.now_s >= self.reached_at_s else pb.MOVING
        return pb.ArmState(
            sequence=round(100.0 * self.now_s),
            mode=self.mode,
            reach=reach,
            binding_limits=self.limits,
            target_sequence=len(self.sent) if self.takes else 0,
            n_sections=1,
            tip_measured_position_m=[0.0, 0.0, 0.2],
            tip_measured_age_s=self.tip_age_s,
        )


@pytest.fixture
def client(monkeypatch: pytest.MonkeyPatch) -> FakeClient:
    fake = FakeClient()
    counted = SimpleNamespace(monotonic=fake.monotonic, sleep=fake.sleep)
    monkeypatch.setattr(drive, "time", counted)
    monkeypatch.setattr(calibration_drive, "time", counted)
    monkeypatch.setattr(drive, "measured_tip", lambda *_: COURSE.wanted_m)
    return fake


def follow(client: FakeClient, warn: Callable[[str], None] = lambda why: None) -> np.ndarray:
    driver = drive.Driver(client, COURSE, load(), lambda _: None, warn)  # type: ignore[arg-type]
    return driver.follow(COURSE.shifted(np.zeros_like(COURSE.wanted_m), 3))


def approach_s(client: FakeClient) -> float:
    """How long the arm was sent to the beginning before the trajectory."""
    kinds = [target.WhichOneof("target") for target in client.sent]
    first = kinds.index("trajectory")
    assert set(kinds[:first]) == {"position"}
    assert set(kinds[first:]) == {"trajectory"}
    return client.sent_s[first] - client.sent_s[0]


@pytest.mark.parametrize(("there_after_s", "pieces"), [(0.0, 1), (4.0, 2), (1e6, 5)])
def test_a_trial_begins_where_the_arm_is_there_or_after_a_patience(
    client: FakeClient, there_after_s: float, pieces: int
) -> None:
    client.reached_at_s = client.now_s + there_after_s
    assert follow(client) is COURSE.wanted_m
    assert approach_s(client) == pytest.approx(pieces * drive.APPROACH_S, abs=0.2)
    lasted_s = client.sent_s[-1] - client.sent_s[0] - approach_s(client)
    assert lasted_s == pytest.approx(COURSE.duration_s + 0.3, abs=0.1)
    gaps_s = np.diff(client.sent_s)
    assert gaps_s.max() < 0.5e-3 * load().control.target_timeout_ms


def test_a_limit_that_keeps_the_arm_from_its_trajectory_is_told_once(client: FakeClient) -> None:
    client.reach, client.limits, warned = pb.OUT_OF_REACH, 4, list[str]()
    driver = drive.Driver(client, COURSE, load(), lambda _: None, warned.append)  # type: ignore[arg-type]
    target = COURSE.shifted(np.zeros_like(COURSE.wanted_m))
    driver.follow(target)
    driver.follow(target)
    assert len(warned) == 1
    assert "pressure" in warned[0]
    client.limits = 1
    driver.follow(target)
    assert len(warned) == 2
    assert "length" in warned[1]


def test_a_hold_on_the_way_ends_it_with_the_mode_and_what_the_daemon_said(
    client: FakeClient,
) -> None:
    client.mode = pb.HOLD
    client.told = []
    state = client.state

    def told() -> pb.ArmState:
        client.told = [pb.Event(code="took_over", mode=pb.HOLD, text="bob took the arm over")]
        return state()

    client.state = told  # type: ignore[method-assign]
    with pytest.raises(ModeRefused) as error:
        follow(client)
    assert all(fact in str(error.value) for fact in ("hold", "took_over", "bob"))


def test_a_tip_that_is_no_longer_measured_ends_it(client: FakeClient) -> None:
    client.tip_age_s = 2.0
    with pytest.raises(LearningError, match="sensor/tip_pose"):
        follow(client)


def test_a_target_that_is_not_taken_loses_the_trial(client: FakeClient) -> None:
    client.takes = False
    with pytest.raises(TrialLost, match="100 ms"):
        follow(client)


def test_a_daemon_that_dies_on_the_way_ends_it(client: FakeClient) -> None:
    client.dies_at_s = client.now_s + drive.APPROACH_S + 0.5
    with pytest.raises(DaemonUnreachable):
        follow(client)
    assert client.sent[-1].WhichOneof("target") == "trajectory"

"""The program that everybody writes first: targets one after another, with a pause at each."""

import math
import time
from collections.abc import Iterator

import pytest

from pneuarm import Client
from pneuarm.controllers.arm.errors import ModeRefused, OutOfReach
from pneuarm.controllers.limits.limits import KINDS
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.moving import LIMITS, of_hold
from tools.rig.daemon import Daemon, wait_for

HOME = (0.0, 0.0, 0.2)
#: Longer than the 200 ms after which a target is stale.
PAUSE_S = 0.4


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    with Daemon(tmp_path_factory.mktemp("first")) as daemon:
        yield daemon


@pytest.fixture
def arm(daemon: Daemon) -> Iterator[Client]:
    with daemon.client() as client:
        wait_for(lambda: client.state().mode in (pb.READY, pb.HOLD), "an arm to enable")
        client.enable()
        yield client


def held(client: Client) -> bool:
    return client.state().mode == pb.HOLD


def test_a_sweep_with_pauses_runs_to_its_end(arm: Client) -> None:
    for x in (0.01, 0.02, 0.01):
        arm.enable()  # as a careful person does before every move
        assert arm.move_to((x, 0.0, 0.2)).reach == pb.REACHED
        time.sleep(PAUSE_S)
    wait_for(lambda: held(arm), "the hold of a program that sleeps")
    assert arm.hold_at(HOME, PAUSE_S).mode == pb.ACTIVE


def test_while_it_waits_the_arm_stays_with_its_target(arm: Client) -> None:
    arm.move_to(HOME, settle_s=PAUSE_S)
    assert arm.wait(PAUSE_S).mode == pb.ACTIVE
    assert "target_stale" not in {event.code for event in arm.past_events().recent[-1:]}


def test_its_own_hold_is_left_by_the_next_move(arm: Client) -> None:
    arm.move_to(HOME)
    arm.hold()
    assert arm.move_to(HOME).reach == pb.REACHED


def test_a_hold_that_somebody_else_asked_for_is_not_left_by_itself(
    daemon: Daemon, arm: Client
) -> None:
    arm.move_to(HOME)
    with daemon.client("person") as person:
        person.hold()
        with pytest.raises(ModeRefused, match="hold"):
            arm.move_to(HOME)
        arm.enable()
        arm.move_to(HOME)
        wait_for(lambda: held(arm), "the hold of a program that sleeps")
        person.hold()  # of an arm that holds already
        with pytest.raises(ModeRefused, match="hold"):
            arm.move_to(HOME)


def test_out_of_reach_is_raised_with_the_nearest_point_and_the_limit(arm: Client) -> None:
    goal = (0.0, 0.0, 0.35)
    with pytest.raises(OutOfReach) as raised:
        arm.move_to(goal)
    state = arm.move_to(goal, strict=False)
    assert state.reach == pb.OUT_OF_REACH
    assert math.dist(raised.value.nearest_m, state.tip_commanded_position_m) < 1e-3
    assert raised.value.limits
    assert set(raised.value.limits) <= set(LIMITS.values())


def test_the_limits_are_called_as_everywhere() -> None:
    assert {kind.bit: kind.words or kind.name for kind in KINDS} == LIMITS


def told(*events: tuple[str, "pb.Mode"]) -> list[str]:
    found = of_hold(pb.Event(source="control", code=code, mode=mode) for code, mode in events)
    return [event.code for event in found]


def test_a_hold_is_told_from_its_beginning_or_not_at_all() -> None:
    active, stale = ("enable", pb.ACTIVE), ("target_stale", pb.HOLD)
    assert told(active, stale) == ["target_stale"]
    assert told(active, ("leak", pb.HOLD), ("hold", pb.HOLD)) == ["leak", "hold"]
    assert told(active, ("leak", pb.HOLD), active, stale) == ["target_stale"]
    assert told(active, stale, active) == []
    assert told(stale, ("hold", pb.HOLD)) == []  # what began it has been forgotten
    assert told() == []

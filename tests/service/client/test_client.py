"""The client for a user's own program, against a real daemon."""

import contextlib
import math
import time
from collections.abc import Iterator
from itertools import islice

import pytest

from pneuarm import Client
from pneuarm.controllers.arm.errors import (
    DaemonUnreachable,
    LeaseRefused,
    MessageRejected,
    ModeRefused,
    MoveTimeout,
    NotConfirmed,
    TargetRejected,
)
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import EVENT, STATE, full_key
from tools.rig.daemon import Daemon, free_port, wait_for

_LENGTH, _BEND, _PRESSURE = 1, 2, 4


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    with Daemon(tmp_path_factory.mktemp("client")) as daemon:
        yield daemon


def is_ready(client: Client) -> bool:
    """Vent, or reset: a stop that was asked for again and again may come after a reset."""
    with contextlib.suppress(ModeRefused):
        if client.state().mode == pb.ESTOP:
            client.reset()
            time.sleep(0.2)
        else:
            client.vent()
    return client.state().mode == pb.READY


@pytest.fixture
def client(daemon: Daemon) -> Iterator[Client]:
    with daemon.client() as client:
        wait_for(lambda: is_ready(client), "an empty arm")
        yield client


def test_context_manager_gives_the_lease_back_and_the_arm_holds(daemon: Daemon) -> None:
    with daemon.client() as client:
        client.enable()
        client.move_to((0.0, 0.0, 0.21))
        assert daemon.health().lease_holder in ("", client.client_id)
    client.close()  # twice is no harm
    with daemon.client("next") as after:
        wait_for(lambda: after.state().mode == pb.HOLD, "the arm to hold")
        assert after.take_lease().lease_holder == after.client_id


def test_state_after_a_mode_request_shows_it(client: Client) -> None:
    for _ in range(5):
        assert client.enable().mode == pb.ACTIVE
        assert client.state().mode == pb.ACTIVE
        client.hold()
        assert client.state().mode == pb.HOLD


def test_move_to_ends_where_it_should(client: Client) -> None:
    client.enable()
    goal = (0.03, -0.02, 0.215)
    state = client.move_to(goal)
    assert state.reach == pb.REACHED
    assert list(state.target_position_m) == list(goal)
    assert math.dist(state.tip_commanded_position_m, goal) <= 0.5e-3
    assert state.target_error_m <= 0.5e-3


@pytest.mark.parametrize(
    ("goal", "bits"), [((0.0, 0.0, 0.35), _LENGTH | _PRESSURE), ((0.3, 0.0, 0.1), 7)]
)
def test_out_of_reach_names_the_binding_limit(
    client: Client, goal: tuple[float, float, float], bits: int
) -> None:
    client.enable()
    state = client.move_to(goal, strict=False)
    assert state.reach == pb.OUT_OF_REACH
    assert state.binding_limits & bits
    assert state.target_error_m > 0.01
    assert math.dist(state.tip_commanded_position_m, goal) == pytest.approx(
        state.target_error_m, abs=1e-6
    )


def test_every_kind_of_target_can_be_sent(client: Client) -> None:
    client.enable()
    sent = {
        pb.POSITION: lambda: client.send_position((0.0, 0.0, 0.2)),
        pb.POSE: lambda: client.send_pose((0.0, 0.0, 0.2), (0.0, 0.0, 0.0, 1.0)),
        pb.TWIST: lambda: client.send_twist((0.01, 0.0, 0.0), (0.0, 0.0, 0.0)),
        pb.LENGTHS: lambda: client.send_lengths((0.2, 0.21, 0.2)),
        pb.PRESSURES: lambda: client.send_pressures((1e4, 0.0, 1e4)),
    }
    for kind, send in sent.items():

        def followed(kind: int = kind, send: "object" = send) -> bool:
            number = send()  # type: ignore[operator]
            state = client.state()
            return state.target_kind == kind and state.target_sequence <= number

        wait_for(followed, f"target of kind {pb.TargetKind.Name(kind)}")
    client.raise_if_refused()


def test_law_is_passed_on(client: Client) -> None:
    client.enable()
    for law in (pb.RESOLVED_RATE, pb.QP_IK):

        def chosen(law: "pb.Law" = law) -> bool:
            client.send_position((0.0, 0.01, 0.2), law)
            return client.state().law == law

        wait_for(chosen, pb.Law.Name(law))


def test_states_come_in_order_and_none_twice(client: Client) -> None:
    numbers = [state.sequence for state in islice(client.states(), 30)]
    assert numbers == sorted(set(numbers))


def test_rejected_target_is_raised(client: Client) -> None:
    client.enable()
    with pytest.raises(TargetRejected, match="is it in mm"):
        client.move_to((20.0, 0.0, 210.0))
    with pytest.raises(TargetRejected, match="must be finite"):
        client.move_to((math.nan, 0.0, 0.2))


def test_move_without_arming_is_refused(client: Client) -> None:
    with pytest.raises((ModeRefused, TargetRejected)):
        client.move_to((0.0, 0.0, 0.2))
    assert client.state().mode == pb.READY


def test_move_that_takes_too_long_is_told_as_that(client: Client) -> None:
    client.enable()
    with pytest.raises(MoveTimeout, match=r"0\.05 s"):
        client.move_to((0.05, 0.0, 0.2), timeout_s=0.05)


def test_refused_mode_is_raised(client: Client) -> None:
    with pytest.raises(ModeRefused, match="nothing to hold"):
        client.hold()
    with pytest.raises(ModeRefused, match="mode is ready"):
        client.reset()
    with pytest.raises(LeaseRefused):
        client.release()


def test_refusal_says_whether_it_is_the_mode_or_the_lease(client: Client, daemon: Daemon) -> None:
    client.enable()
    with daemon.client("other") as other:
        with pytest.raises(ModeRefused) as refused:
            other.reset()  # nothing to reset, whoever holds the lease
        assert not isinstance(refused.value, LeaseRefused)
        with pytest.raises(LeaseRefused, match=client.client_id):
            other.enable()
        other.client_id = "x" * 65
        with pytest.raises(MessageRejected, match="client_id"):
            other.enable()


def test_stop_is_confirmed_latched_and_left_by_reset(client: Client, daemon: Daemon) -> None:
    client.enable()
    with daemon.client("anybody") as other:
        assert other.estop().mode == pb.ESTOP
    assert client.state().mode == pb.ESTOP
    with pytest.raises(ModeRefused, match="emergency stop is latched"):
        client.enable()
    assert client.reset().mode == pb.IDLE
    client.enable()  # waits for the air to go


def test_a_reset_stays_whatever_stop_came_before_it(client: Client) -> None:
    for _ in range(8):
        client.estop()
        client.estop()  # the state shows a stop already, that of the one before
        time.sleep(0.005)
        assert client.reset().mode == pb.IDLE
        time.sleep(0.05)
        assert client.state().mode != pb.ESTOP


def test_stop_that_nothing_shows_is_not_confirmed(client: Client, daemon: Daemon) -> None:
    gateway = daemon.pids("gateway")["gateway"]
    with (
        daemon.standing_still(gateway),
        pytest.raises(NotConfirmed, match=r"NOT CONFIRMED: .* cut the air supply"),
    ):
        client.estop()
    wait_for(lambda: client.state().mode == pb.ESTOP, "the belated stop")
    wait_for(lambda: is_ready(client), "an arm that is reset")


def test_what_is_no_state_and_no_event_is_passed_over(client: Client, daemon: Daemon) -> None:
    client.events()
    newest = 0
    with daemon.client("rogue") as rogue:
        for _ in range(20):
            for topic in (STATE, EVENT):
                rogue._session.put(full_key(daemon.arm, topic.key), b"\xff\xff\xff")
            time.sleep(0.003)
            state = client.state()
            assert state.mode == pb.READY
            assert state.sequence >= newest
            newest = state.sequence
            client.events()


def test_info_is_the_daemons(client: Client, daemon: Daemon) -> None:
    info = client.info()
    assert info.arm == daemon.arm
    assert daemon.arm in info.config_toml
    assert info.rate_hz == 1000.0


def test_nobody_there_and_nobody_of_that_name(daemon: Daemon) -> None:
    with pytest.raises(DaemonUnreachable, match=r"nobody answers at .* start the daemon"):
        Client("paper", f"tcp/127.0.0.1:{free_port()}")
    with pytest.raises(DaemonUnreachable, match="none for arm 'ghost'"):
        Client("ghost", daemon.endpoint)

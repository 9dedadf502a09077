"""The command pipe: order, no waiting, losses counted, the end seen, alive after a spawn."""

import multiprocessing
import select
import time

import numpy as np
import pytest

from pneuarm.controllers.targets.targets import LengthsTarget, PositionTarget
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.processes.pipe import (
    Heartbeat,
    ModeReply,
    Pipe,
    RequestMode,
    SetTarget,
    SetTipPose,
    Shutdown,
    new_pipe,
)


def request(number: int) -> RequestMode:
    return RequestMode(ModeEvent.HOLD, number, "me")


def test_messages_arrive_in_their_order_both_ways() -> None:
    one, other = new_pipe()
    for number in range(10):
        assert one.send(request(number))
        assert other.send(ModeReply(number, True, "", Mode.HOLD, 5))
    assert [other.receive() for _ in range(10)] == [request(number) for number in range(10)]
    assert one.receive() == ModeReply(0, True, "", Mode.HOLD, 5)
    assert (one.dropped, one.closed) == (0, False)


def test_every_message_comes_out_as_it_went_in() -> None:
    one, other = new_pipe()
    target = SetTarget(PositionTarget(np.array([0.1, np.pi, -1e-300])), 2**63, 2**62)
    pose = SetTipPose(np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 0.0, 1.0]), 7)
    for message in (target, pose, Heartbeat(True), Shutdown()):
        one.send(message)
    found = other.receive()
    assert isinstance(found, SetTarget)
    assert isinstance(found.target, PositionTarget)
    assert found.target.position_m.tobytes() == target.target.position_m.tobytes()
    assert (found.sequence, found.received_ns) == (2**63, 2**62)
    found_pose = other.receive()
    assert isinstance(found_pose, SetTipPose)
    assert found_pose.quaternion_xyzw.tolist() == [0.0, 0.0, 0.0, 1.0]
    assert (other.receive(), other.receive()) == (Heartbeat(True), Shutdown())


@pytest.mark.timeout(10)
def test_an_empty_pipe_does_not_make_anybody_wait() -> None:
    one, other = new_pipe()
    assert other.receive() is None
    assert not other.closed
    one.send(Shutdown())
    assert other.receive() == Shutdown()
    assert other.receive() is None


@pytest.mark.timeout(10)
def test_a_full_pipe_does_not_make_anybody_wait_and_what_is_dropped_is_counted() -> None:
    one, other = new_pipe()
    results = [one.send(request(number)) for number in range(5000)]
    sent = results.count(True)
    assert 0 < sent < 5000
    assert results == [True] * sent + [False] * (5000 - sent)
    assert one.dropped == 5000 - sent
    received = [other.receive() for _ in range(sent)]
    assert received == [request(number) for number in range(sent)]
    assert other.receive() is None
    assert one.send(request(9999))
    assert other.receive() == request(9999)


def test_a_message_that_would_arrive_cut_off_is_dropped() -> None:
    one, other = new_pipe()
    assert not one.send(SetTarget(LengthsTarget(np.zeros((3500, 3))), 1, 1))
    assert one.dropped == 1
    assert other.receive() is None
    assert not other.closed


def test_the_end_of_the_other_side_is_seen_after_its_last_message() -> None:
    one, other = new_pipe()
    one.send(Shutdown())
    one.close()
    assert other.receive() == Shutdown()
    assert not other.closed
    assert other.receive() is None
    assert other.closed
    assert not other.send(Shutdown())
    assert other.dropped == 1


def test_it_can_be_waited_for() -> None:
    one, other = new_pipe()
    assert select.select([other], [], [], 0)[0] == []
    one.send(Shutdown())
    assert select.select([other], [], [], 0)[0] == [other]


def answer_in_child(pipe: Pipe) -> None:
    """Answer requests until told to end; says so when it looked and nothing was there."""
    said = False
    while True:
        message = pipe.receive()
        if message is None:
            said = said or pipe.send(Heartbeat(False))
            time.sleep(0.001)
        elif isinstance(message, RequestMode):
            pipe.send(ModeReply(message.request_id, True, "", Mode.IDLE, 1))
        elif isinstance(message, Shutdown):
            return


@pytest.mark.timeout(50)
def test_it_survives_a_spawn_and_does_not_block_there_either() -> None:
    one, other = new_pipe()
    child = multiprocessing.get_context("spawn").Process(
        target=answer_in_child, args=(other,), daemon=True
    )
    child.start()
    other.close()
    assert select.select([one], [], [], 30)[0]
    assert one.receive() == Heartbeat(False)
    for number in range(20):
        one.send(request(number))
        assert select.select([one], [], [], 30)[0]
        reply = one.receive()
        assert isinstance(reply, ModeReply)
        assert reply.request_id == number
    one.send(Shutdown())
    child.join(30)
    assert child.exitcode == 0
    assert one.receive() is None
    assert one.closed

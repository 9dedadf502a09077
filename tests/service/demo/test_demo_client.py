"""The client of the demo goes on after whatever a busy machine did to its arm."""

from collections.abc import Callable

import pytest

from pneuarm.controllers.arm.errors import DaemonUnreachable, ModeRefused, TargetRejected
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.demo import client as demo


class Arm:
    """The daemon as far as this client asks for it: arming one that is active is refused."""

    def __init__(self, mode: "pb.Mode") -> None:
        self.mode = mode

    def state(self) -> pb.ArmState:
        return pb.ArmState(mode=self.mode)

    def events(self) -> None:
        pass

    def take_lease(self) -> None:
        pass

    def reset(self) -> None:
        assert self.mode == pb.FAULT
        self.mode = pb.READY

    def enable(self) -> None:
        if self.mode not in (pb.READY, pb.HOLD):
            raise ModeRefused("no")
        self.mode = pb.ACTIVE


@pytest.mark.parametrize("error", [TargetRejected, ModeRefused, DaemonUnreachable])
@pytest.mark.parametrize("left", [pb.ACTIVE, pb.HOLD, pb.READY, pb.FAULT])
def test_it_arms_again_from_whatever_is_left_and_gives_up_in_the_end(
    left: "pb.Mode", error: type[Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(demo, "_PAUSE_S", 0.0)
    arm, failures = Arm(pb.READY), 2

    def act() -> str:
        nonlocal failures
        assert arm.mode == pb.ACTIVE
        if failures:
            failures -= 1
            arm.mode = left
            raise error("interrupted")
        return "drawn"

    persist: Callable[..., str] = demo._persist
    assert persist(arm, act) == "drawn"
    failures = 100
    with pytest.raises(error):
        persist(arm, act)

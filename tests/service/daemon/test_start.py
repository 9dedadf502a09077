"""The start of a daemon whose control does not get to its first tick."""

from types import SimpleNamespace
from typing import Any

import pytest

from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.service.daemon import supervisor
from pneuarm.service.daemon.supervisor import Supervisor


def starting(alive: bool) -> Any:
    """A supervisor whose control never ticks, alive or not."""
    return SimpleNamespace(
        _shared=None,
        _arm_lock=None,
        _device_lock=None,
        _control_end=None,
        _requests=(None, None),
        _stream=(None, None),
        _add=lambda name, arguments: SimpleNamespace(is_alive=lambda: alive),
        _ending=False,
        _ticks=SimpleNamespace(head=lambda: 0),
        _said=lambda code: "the cable is out",
    )


@pytest.mark.parametrize(("alive", "fact"), [(True, "busy"), (False, "the cable is out")])
def test_a_control_without_a_tick_ends_the_start_with_its_cause(
    alive: bool, fact: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a busy machine it was taken for one that had died in the middle of its work."""
    monkeypatch.setattr(supervisor, "_FIRST_TICK_S", 0.05)
    with pytest.raises(HardwareError, match=fact):
        Supervisor._start_control(starting(alive))

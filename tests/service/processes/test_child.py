"""A child that is told to end has its time, and more as long as it gets further."""

import multiprocessing
from collections.abc import Callable

import pytest

from pneuarm.service.processes import child as module
from pneuarm.service.processes.child import Child
from pneuarm.service.processes.usage import ProcessTable

CONTEXT = multiprocessing.get_context("spawn")


class Busy(Child):
    """A child without a process, which has ended after so many looks; time is counted."""

    def __init__(self, looks: int) -> None:
        super().__init__("recorder", "", CONTEXT, (), ProcessTable.create(CONTEXT))
        self.now_s, self.looks, self.killed = 0.0, looks, False

    def join(self, patience_s: float) -> bool:
        """Let the time pass."""
        self.now_s += patience_s
        self.looks -= 1
        return self.looks < 0

    def kill(self) -> None:
        """Note it."""
        self.killed = True

    def monotonic(self) -> float:
        """Stand for the clock."""
        return self.now_s


@pytest.mark.parametrize(
    ("advances", "looks", "ends"),
    [(False, 3, True), (False, 100, False), (True, 1000, True)],
)
def test_patience_begins_anew_with_every_step(
    monkeypatch: pytest.MonkeyPatch, advances: bool, looks: int, ends: bool
) -> None:
    child = Busy(looks)
    monkeypatch.setattr(module, "time", child)
    progress: Callable[[], object] = (lambda: child.now_s) if advances else (lambda: 0)
    assert child.end(2.0, progress) is ends
    assert child.killed is not ends

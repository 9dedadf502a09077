"""What every task gives to a law: its part of the vector of what is wanted."""

from dataclasses import dataclass
from typing import Protocol

from pneuarm.controllers.tasks.wanted import Wanted


class Task(Protocol):
    """Something wanted of the arm. A weight counts beside the other tasks' weights."""

    def write(self, wanted: Wanted) -> None:
        """Write down what is wanted; other parts are left alone."""
        ...


@dataclass(frozen=True)
class Combined:
    """Several tasks at once; where they contradict, the weighted compromise of least squares."""

    tasks: tuple[Task, ...]

    def write(self, wanted: Wanted) -> None:
        """Write down what each of them wants."""
        for task in self.tasks:
            task.write(wanted)


def fill(wanted: Wanted, task: Task, gain_per_s: float, speed_max_m_s: float) -> None:
    """Ask for one task and nothing else, with errors worked off at a gain and up to a speed."""
    wanted.forget(gain_per_s, speed_max_m_s)
    task.write(wanted)

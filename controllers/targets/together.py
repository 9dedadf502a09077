"""Several tasks at once."""

from dataclasses import dataclass
from itertools import combinations
from typing import Self

from pneuarm.controllers.arm.errors import TargetRejected
from pneuarm.controllers.targets import checks
from pneuarm.controllers.targets.chambers import LengthsTarget, PostureTarget
from pneuarm.controllers.targets.direction import DirectionTarget
from pneuarm.controllers.targets.point import PointTarget
from pneuarm.controllers.targets.pose import PoseTarget
from pneuarm.controllers.targets.position import PositionTarget
from pneuarm.controllers.targets.target import LawName, Target
from pneuarm.controllers.tasks.wanted import Wanted

#: What may be one of several tasks.
COMBINED: tuple[type[Target], ...] = (
    PositionTarget,
    PoseTarget,
    DirectionTarget,
    PointTarget,
    LengthsTarget,
    PostureTarget,
)

#: Weights count beside each other; beyond this the QP loses the digits of the others.
_HEAVIEST = 1e3


@dataclass(frozen=True)
class TasksTarget(Target):
    """Several at once, each with its weight; where they contradict, the least squares of them."""

    name, kind = "tasks", 8

    targets: tuple[Target, ...]
    law: LawName = LawName.DEFAULT

    @classmethod
    def checked(cls, fields: checks.Fields, allowed: checks.Allowed, law: LawName) -> Self:
        """At least one task besides the posture, and none that sets what another one sets."""
        kinds = [_kind(task) for task in fields["tasks"]]
        if not any(kind.alone for kind in kinds):
            raise TargetRejected("tasks holds no task besides posture; at least one is needed")
        for kind in kinds:
            if kinds.count(kind) > 1:
                raise TargetRejected(f"tasks holds {kind.name} twice; once is allowed")
        targets = [
            kind.checked(task[kind.name], allowed, LawName.DEFAULT).weighted(*_weights(kind, task))
            for kind, task in zip(kinds, fields["tasks"], strict=True)
        ]
        for one, other in combinations(targets, 2):
            both = one.sets() & other.sets()
            if both:
                raise TargetRejected(
                    f"tasks holds {one.name} and {other.name}, which contradict: both set the "
                    f"tip's {' and '.join(sorted(both))}; drop one"
                )
        return cls(tuple(targets), law)

    def write(self, wanted: Wanted) -> None:
        """Write down what each of them wants."""
        for target in self.targets:
            target.write(wanted)


def _kind(task: checks.Fields) -> type[Target]:
    for kind in COMBINED:
        if task[kind.name] is not None:
            return kind
    names = ", ".join(kind.name for kind in COMBINED)
    raise TargetRejected(f"tasks holds an empty task; one of {names}")


def _weights(kind: type[Target], task: checks.Fields) -> tuple[float, float]:
    weight, orientation = task["weight"], task["orientation_weight"]
    for name, value, left_out in (
        ("weight", weight, False),
        ("orientation_weight", orientation, orientation == 0.0),
    ):
        if not (0.0 < value <= _HEAVIEST or left_out):
            raise TargetRejected(
                f"{name} of task {kind.name} is {value:g}; allowed: above 0 to "
                f"{_HEAVIEST:g}; leave out a task that is not to count"
            )
    return weight, orientation or weight

"""The tip at a position."""

from dataclasses import dataclass, replace
from typing import Self

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.targets import checks
from pneuarm.controllers.targets.target import LawName, Target
from pneuarm.controllers.tasks.wanted import Wanted


@dataclass(frozen=True)
class PositionTarget(Target):
    """Tip at ``position_m`` (3,), by proportional feedback.

    ``velocity_m_s`` (3,) is how the position itself moves: it is added to the feedback, so that a
    moving position is followed without lag. What the position leaves free goes to the posture.

    ``nearest_lengths_m`` (n_sections, 3) are the lengths that bring the tip nearest, for a position
    out of reach, from :meth:`pneuarm.controllers.workspace.workspace.Workspace.is_reachable`:
    finding them takes too long for a tick.
    """

    name, kind = "position", 1

    position_m: Array
    law: LawName = LawName.DEFAULT
    velocity_m_s: Array | None = None
    nearest_lengths_m: Array | None = None
    weight: float = 1.0
    posture_weight: float = 1.0

    @classmethod
    def checked(cls, fields: checks.Fields, allowed: checks.Allowed, law: LawName) -> Self:
        """Position in the base frame, and a velocity that an arm can have."""
        position, velocity = allowed.position(fields), None
        if fields["velocity_m_s"] is not None:
            velocity = checks.rate(fields, "velocity_m_s", checks.FASTEST_M_S, "m/s", "mm/s")
        return cls(position, law, velocity)

    def write(self, wanted: Wanted) -> None:
        """Three rows."""
        wanted["position_m"] = self.position_m
        wanted["velocity_m_s"] = 0.0 if self.velocity_m_s is None else self.velocity_m_s
        wanted["position_weight"], wanted["position_follows"] = self.weight, 1.0
        wanted["posture_weight"] = self.posture_weight

    def weighted(self, weight: float, orientation_weight: float) -> "PositionTarget":
        """Beside others it stands: a velocity is for a position alone."""
        return replace(self, weight=weight, velocity_m_s=None)

    def goal(self) -> tuple[Array | None, Array | None]:
        """Return the position."""
        return self.position_m, None

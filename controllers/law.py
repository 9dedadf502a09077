"""What every control law is: a step of the chamber lengths toward a task, inside the limits."""

from dataclasses import dataclass
from typing import Protocol

from controllers.arm import Arm, Array
from controllers.kinematics.compiled import TipState
from controllers.limits.bend import BendLimit
from controllers.limits.length import LengthLimit
from controllers.limits.length_rate import LengthRateLimit
from controllers.tasks.task import Task

#: A length (m) or a bend times the chamber offset (m) this close to its bound is at the bound.
AT_BOUND_M = 1e-5


class Limits:
    """The limits of one arm, shared by the laws."""

    def __init__(self, arm: Arm) -> None:
        self.length = LengthLimit(arm)
        self.rate = LengthRateLimit(arm)
        self.bend = BendLimit(arm)

    def clip(self, lengths_m: Array) -> Array:
        """Nearest lengths that respect length and bend; the last word on every command."""
        return self.bend.clip(self.length.clip(lengths_m))


@dataclass(frozen=True)
class LawStep:
    """The next lengths (n_sections, 3), and whether the law had to fall back to another."""

    lengths_m: Array
    fell_back: bool = False


class Law(Protocol):
    """A control law."""

    def step(self, task: Task, tip: TipState, lengths_m: Array, dt_s: float) -> LawStep:
        """Return lengths one tick later, strictly inside the limits."""
        ...


def clamped_step(limits: Limits, lengths_m: Array, step_m: Array, dt_s: float) -> Array:
    """Apply a step (n_chambers,): scaled to the rate limit as a whole, then clipped.

    Scaling keeps its direction, so the tip slows down instead of turning aside.
    """
    allowed = limits.rate.rate_max_m_s.reshape(lengths_m.shape) * max(dt_s, 1e-9)
    step = step_m.reshape(lengths_m.shape)
    wanted = limits.clip(lengths_m + _share_allowed(allowed, step) * step)
    # Unbending may take a chamber further than the step did. The bounds of length and bend are
    # convex, so a part of the way lies inside them too.
    moved = wanted - lengths_m
    share = _share_allowed(allowed, moved)
    return wanted if share > 1.0 - 1e-9 else lengths_m + share * moved


def _share_allowed(allowed: Array, step: Array) -> float:
    """Return the largest share, up to 1, of a step in which no chamber exceeds its allowance."""
    largest = max(map(abs, (step / allowed).reshape(-1).tolist()))
    return 1.0 if largest <= 1.0 else 1.0 / largest

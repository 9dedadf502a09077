"""What a limit tells of itself, so that whatever moves the arm can go through a list of them."""

from abc import ABC, abstractmethod
from functools import cached_property
from typing import ClassVar

import casadi as ca

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.geometry.compiled_function import CompiledFunction

#: A length (m) or a bend times the chamber offset (m) this close to its bound is at the bound.
AT_BOUND_M = 2e-5

_NONE = ca.SX(0, 1)


class Limit(ABC):
    """What no commanded lengths may exceed, as what is left of it, in metres.

    The rows of the QP are the linearisation of :meth:`slack`, and the exact check after the QP is
    its sign: both come from the one expression, so that they cannot differ.
    """

    #: How the limit is called where it stops the arm, and its bit in ``binding_limits``.
    name: ClassVar[str]
    bit: ClassVar[int]
    #: The same for people, where the name alone does not say which of the paper's equations it is.
    words: ClassVar[str] = ""
    #: What the QP leaves: along a curved bound a straight step needs room; OSQP has a tolerance.
    margin_m: ClassVar[float]
    #: Less than this (m) is left where the limit is what stops the arm.
    at_bound_m: ClassVar[float] = AT_BOUND_M
    #: Whether a straight way (in the lengths) between two allowed places is allowed.
    convex: ClassVar[bool] = False
    #: Whether the slack of a chamber's quantity comes twice: n distances to lower bounds, then n to
    #: upper ones. Else every slack is a bound of its own, whose row turns as the arm moves.
    two_sided: ClassVar[bool] = False
    #: Whether :mod:`pneuarm.controllers.workspace` knows it: the exact answers about one section.
    in_workspace: ClassVar[bool] = False

    def __init__(self, arm: Arm) -> None:
        self._arm = arm

    @classmethod
    def applies_to(cls, arm: Arm) -> bool:
        """Whether the arm has such a limit."""
        return True

    @abstractmethod
    def slack(self, lengths: ca.SX) -> ca.SX:
        """Return what is left (k,), in metres, at ``lengths`` (n_chambers,); below 0: exceeded."""

    def approach(self, slack: ca.SX, share: ca.SX) -> ca.SX:
        """How much of a slack a step may use up: a ``share`` of it, as toward a target there."""
        return share * (slack - self.margin_m)

    def rate_share(self, lengths: ca.SX, rates: ca.SX) -> ca.SX:
        """Shares (k,) of what the rates (n_chambers,), m/s, may be, to first order; mostly none."""
        return _NONE

    def step_slack(self, before: ca.SX, after: ca.SX, dt: ca.SX) -> ca.SX:
        """What a step of ``dt`` seconds leaves (k,), in metres, exactly; mostly nothing to ask."""
        return _NONE

    def clip(self, lengths_m: Array) -> Array:
        """Lengths (n_sections, 3) near the given ones that respect the limit, where it can."""
        return lengths_m

    def left_m(self, lengths_m: Array) -> Array:
        """Return :meth:`slack` at lengths (n_sections, 3), in an array that is used again."""
        return self._compiled(lengths_m)[0]

    def stops(self, lengths_m: Array) -> bool:
        """Whether lengths (n_sections, 3) are at the limit."""
        return bool((self.left_m(lengths_m) < self.at_bound_m).any())

    def contradiction(self) -> str:
        """What keeps the arm from resting vented within the limit, one sentence; "" if nothing."""
        left_m = float(self.left_m(self._arm.rest_lengths_m).min())
        if left_m >= 0.0:
            return ""
        return f"the arm at rest is beyond the limit of its {self.name} by {-1e3 * left_m:.3g} mm"

    @cached_property
    def _compiled(self) -> CompiledFunction:
        lengths = ca.SX.sym("lengths", self._arm.n_chambers)
        return CompiledFunction("slack", [lengths], [self.slack(lengths)])


def column(values: Array) -> ca.DM:
    """Constants (n_chambers,) of an array (n_sections, 3)."""
    return ca.DM(values.ravel())

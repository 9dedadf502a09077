"""The limits on where the chambers of an arm may be, shared by everything that moves them."""

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.limits.bend import BendLimit
from pneuarm.controllers.limits.keep_out import KeepOutLimit
from pneuarm.controllers.limits.length import LengthLimit
from pneuarm.controllers.limits.limit import Limit
from pneuarm.controllers.limits.pressure import PressureLimit

#: A length (m) or a bend times the chamber offset (m) this close to its bound is at the bound.
AT_BOUND_M = 2e-5


class Limits:
    """The limits of one arm on where its chambers may be, all of them."""

    def __init__(self, arm: Arm) -> None:
        self.length = LengthLimit(arm)
        self.pressure = PressureLimit(arm)
        self.bend = BendLimit(arm)
        #: In which a straight way between two allowed places is allowed.
        self.convex: tuple[Limit, ...] = (self.length, self.bend)
        self.others: tuple[Limit, ...] = (self.pressure,)
        #: Whose rows turn as the arm moves.
        self.curved: tuple[Limit, ...] = (self.bend,)
        if arm.keep_outs:
            self.keep_out = KeepOutLimit(arm)
            self.others += (self.keep_out,)
            self.curved += (self.keep_out,)

    def clip(self, lengths_m: Array) -> Array:
        """Nearest lengths that respect length and bend."""
        return self.bend.clip(self.length.clip(lengths_m))

"""What every limit gives to the compiled step."""

from typing import Protocol

import casadi as ca


class Limit(Protocol):
    """What no commanded lengths may exceed, as what is left of it.

    The rows of the QP are its linearisation, and the exact check after the QP is its sign: both
    come from the one expression, so that they cannot differ. ``margin_m`` is what the QP leaves:
    along a curved bound a straight step needs room, and OSQP has a tolerance.
    """

    margin_m: float

    def slack(self, lengths: ca.SX) -> ca.SX:
        """Return what is left (k,), in metres, at ``lengths`` (n_chambers,); below 0: exceeded."""
        ...

"""The singularity-free form in arbitrary precision, by the standard library's decimals."""

from decimal import Decimal, localcontext

import numpy as np

_DIGITS = 60
_TERMS = 70


def functions(q: Decimal) -> dict[str, Decimal]:
    """S, C, E and the derivatives of S and C over q, summed as series; good to q = 100 rad^2."""
    sums = dict.fromkeys(("s", "c", "e", "ds", "dc"), Decimal(0))
    power, factorial = Decimal(1), Decimal(1)  # (-q)^k and (2k + 1)!
    for k in range(_TERMS):
        sums["s"] += power / factorial
        sums["c"] += power / (factorial * (2 * k + 2))
        following = factorial * (2 * k + 2) * (2 * k + 3)
        sums["e"] += power / following
        sums["ds"] -= (k + 1) * power / following
        sums["dc"] -= (k + 1) * power / (following * (2 * k + 4))
        power, factorial = -q * power, following
    return sums


def smooth(q: float) -> dict[str, float]:
    """The functions at ``q`` (rad^2), each rounded once."""
    with localcontext(prec=_DIGITS):
        return {name: float(value) for name, value in functions(Decimal(q)).items()}


def position_m(shape: np.ndarray) -> list[Decimal]:
    """Tip position of the section with ``shape`` (L, u, v), not rounded: m."""
    arc_length, u, v = (Decimal(float(value)) for value in shape)
    with localcontext(prec=_DIGITS):
        f = functions(u * u + v * v)
        return [arc_length * u * f["c"], arc_length * v * f["c"], arc_length * f["s"]]

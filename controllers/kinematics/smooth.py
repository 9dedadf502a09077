"""The functions of the bending angle that the singularity-free form is made of.

With ``q = theta^2`` all of them are entire, so nothing happens at the straight arm::

    S = sin(theta)/theta    C = (1 - cos(theta))/q    E = (1 - S)/q    F = (1/2 - C)/q
    dS/dq = (E - C)/2       dC/dq = F - E/2

C and E of the quarter angle are summed as power series and the angle is doubled twice. That takes
additions and products alone: no digit is lost to a small divisor, no branch stands at the straight
arm, and it is several times faster than a sine.
"""

from dataclasses import dataclass
from math import factorial
from typing import Any

import numpy as np

from pneuarm.controllers.arm.arm import Array

#: Up to this q (rad^2, theta = 2 pi) the series are summed; above, the closed forms are exact.
_SERIES_BELOW = 4.0 * np.pi**2
_TERMS = 10


def series(terms: int) -> list[tuple[float, float]]:
    """Coefficients of C and E over q, highest power first."""
    pairs = [
        ((-1) ** k / factorial(2 * k + 2), (-1) ** k / factorial(2 * k + 3)) for k in range(terms)
    ]
    return pairs[::-1]


#: (terms, 2, 1); what is left out is 1e-17 at theta = 2 pi.
_COEFFICIENTS = np.array(series(_TERMS))[:, :, None]


@dataclass(frozen=True)
class Smooth:
    """The functions and derivatives at bending angles: arrays of one shape, or CasADi symbols."""

    s: Any
    c: Any
    e: Any
    ds: Any
    dc: Any


def from_quarter(q: Any, c: Any, e: Any) -> Smooth:
    """All functions at ``q`` (rad^2) from C and E at the quarter angle, by doubling it twice."""
    x = 0.0625 * q
    s = 1.0 - x * e
    half_s, half_c, half_e = s * (1.0 - x * c), 0.5 * s * s, 0.25 * (e + s * c)
    return _with_derivatives(
        half_s * (1.0 - 0.25 * q * half_c),
        0.5 * half_s * half_s,
        0.25 * (half_e + half_s * half_c),
        0.125 * half_e * (1.0 + half_s),
    )


def _with_derivatives(s: Any, c: Any, e: Any, f: Any) -> Smooth:
    return Smooth(s, c, e, 0.5 * (e - c), f - 0.5 * e)


def _sums(x: Array) -> Array:
    """C and E (2, m) at ``x`` (m,), rad^2, by Horner's rule."""
    sums = np.empty((2, x.size))
    np.multiply(x, _COEFFICIENTS[0], out=sums)
    sums += _COEFFICIENTS[1]
    for pair in _COEFFICIENTS[2:]:
        sums *= x
        sums += pair
    return sums


def s_and_c(q: Array) -> tuple[Array, Array]:
    """Return S and C (m,) at ``q = theta^2`` (m,), rad^2; absolute error some 1e-16."""
    if q.max(initial=0.0) > _SERIES_BELOW:
        theta = np.sqrt(q)
        return np.sinc(theta / np.pi), 0.5 * np.sinc(theta / (2.0 * np.pi)) ** 2
    x = q * 0.0625
    sums = _sums(x)
    sums *= x
    cos, s = np.subtract(1.0, sums, out=sums)
    c = s * cos  # S of the half angle
    s *= s
    s *= x
    s *= -2.0
    s += 1.0  # the cosine of the half angle
    s *= c
    c *= c
    c *= 0.5
    return s, c


def smooth(q: Array) -> Smooth:
    """Return all functions (...) at ``q = theta^2`` (...), rad^2; absolute error some 1e-16."""
    large = q > _SERIES_BELOW
    inside = np.where(large, 0.0, q)
    near = from_quarter(inside, *_sums(0.0625 * inside.reshape(-1)).reshape(2, *q.shape))
    if not large.any():
        return near
    outside = np.where(large, q, 1.0)
    s, c = (values.reshape(q.shape) for values in s_and_c(outside.reshape(-1)))
    far = _with_derivatives(s, c, (1.0 - s) / outside, (0.5 - c) / outside)
    names = ("s", "c", "e", "ds", "dc")
    return Smooth(*(np.where(large, getattr(far, name), getattr(near, name)) for name in names))

"""Whether two targets ask for the same, as far as an arm can tell.

Programs calculate anew what they send again, or have measured it: the last digits differ.
"""

import math
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.targets.target import Target

#: Positions (m), lengths (m), parts of unit vectors and quaternions, times (s), as near as this are
#: the same: less than any camera sees or any valve can do.
SAME = 1e-5
#: Pressures (Pa) likewise.
SAME_PA = 1.0


def same(one: Target, other: Target | None) -> bool:
    """Whether two targets are of one kind, and all their fields that count are the same.

    To be compared with the one that was taken first: what creeps is another target in the end.
    """
    if one is other:
        return True
    if type(one) is not type(other) or not is_dataclass(one):
        return False
    return all(
        _same_field(field.name, getattr(one, field.name), getattr(other, field.name))
        for field in fields(one)
        if field.compare
    )


def is_near(one: Array, other: Array) -> bool:
    """Whether two positions (3,) are the same as far as an arm can tell."""
    return bool(float(np.abs(one - other).max()) <= SAME)


def _same_field(name: str, one: Any, other: Any) -> bool:
    tolerance = SAME_PA if name.endswith("_pa") else SAME
    if name.startswith("quaternion") and _equal(one, -other, tolerance):
        return True  # a rotation has two, and what measures it may take either
    return _equal(one, other, tolerance)


def _equal(one: object, other: object, tolerance: float) -> bool:
    if one is other:
        return True
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return one.shape == other.shape and bool((np.abs(one - other) <= tolerance).all())
    if isinstance(one, float) and isinstance(other, float):
        return one == other or math.isclose(one, other, rel_tol=0.0, abs_tol=tolerance)
    if isinstance(one, tuple) and isinstance(other, tuple):
        pairs = zip(one, other, strict=False)
        return len(one) == len(other) and all(_equal(a, b, tolerance) for a, b in pairs)
    if isinstance(one, Target):
        return isinstance(other, Target) and same(one, other)
    return type(one) is type(other) and one == other

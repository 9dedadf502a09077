"""Checked arguments: a refusal names the argument, its value and what is allowed.

In a batch the index of the first offending element stands behind the name.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput

#: Largest entry of ``R^T R - 1`` at which a matrix still counts as a rotation; a quaternion that
#: went through single precision stays below it.
ROTATION_TOLERANCE = 1e-6

_LAST_ROW = np.array([0.0, 0.0, 0.0, 1.0])


def refuse_where(bad: NDArray[np.bool_], name: str, values: Array, allowed: str) -> None:
    """Raise InvalidInput for the first element of ``values`` at which ``bad`` is True.

    ``bad`` has the leading axes of ``values``: the value shown may be a whole vector or matrix.
    """
    if bad.any():
        index = tuple(int(axis) for axis in np.argwhere(bad)[0])
        place = f"{name}[{', '.join(map(str, index))}]" if index else name
        raise InvalidInput(f"{place} = {values[index].tolist()}: {allowed}")


def shaped(name: str, values: ArrayLike, *tail: int) -> Array:
    """Return ``values`` as float64 of the shape ``(..., *tail)``; raise InvalidInput otherwise."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"{name} = {values!r}: an array of real numbers is needed") from error
    if array.shape[array.ndim - len(tail) :] != tail or array.ndim < len(tail):
        wanted = ", ".join(["...", *map(str, tail)])
        raise InvalidInput(f"{name} has the shape {array.shape}: ({wanted}) is needed")
    return array


def finite(name: str, values: ArrayLike, *tail: int) -> Array:
    """Return ``values`` shaped ``(..., *tail)``; raise InvalidInput for a NaN or an infinity."""
    array = shaped(name, values, *tail)
    refuse_where(~np.isfinite(array), name, array, "it must be finite")
    return array


def positive(name: str, values: ArrayLike, *tail: int, what: str = "it") -> Array:
    """Return ``values`` shaped ``(..., *tail)``, every element finite and above 0."""
    array = shaped(name, values, *tail)
    bad = ~((array > 0.0) & np.isfinite(array))
    refuse_where(bad, name, array, f"{what} must be above 0 and finite")
    return array


def within(name: str, values: ArrayLike, low: float, high: float, what: str) -> Array:
    """Return ``values`` (...), every element in the closed interval from ``low`` to ``high``."""
    array = shaped(name, values)
    bad = ~((array >= low) & (array <= high))
    refuse_where(bad, name, array, f"{what} must lie between {low:g} and {high:g}")
    return array


def one_of(name: str, value: str, allowed: tuple[str, ...]) -> None:
    """Raise InvalidInput unless ``value`` is one of the ``allowed`` names."""
    if value not in allowed:
        raise InvalidInput(f"{name} = {value!r}: it must be one of {', '.join(allowed)}")


def broadcast(**named: Array) -> tuple[int, ...]:
    """Return the common batch shape of named arrays (...); raise InvalidInput if there is none."""
    try:
        return np.broadcast_shapes(*(array.shape for array in named.values()))
    except ValueError as error:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in named.items())
        raise InvalidInput(f"shapes that do not go together: {shapes}") from error


def chamber_lengths(arm: Arm, lengths_m: ArrayLike) -> Array:
    """Return ``lengths_m`` (..., n_sections, 3), strictly inside the interval of every section.

    Raises InvalidInput with the index, the length and the interval of Eq. (4).
    """
    array = shaped("lengths_m", lengths_m, arm.n_sections, 3)
    for index, section in enumerate(arm.sections):
        bad = np.zeros(array.shape, dtype=bool)
        of_section = array[..., index, :]
        inside = (of_section > section.length_min_m) & (of_section < section.length_max_m)
        bad[..., index, :] = ~inside
        interval = f"({section.length_min_m:g}, {section.length_max_m:g}) m"
        refuse_where(
            bad, "lengths_m", array, f"a chamber of section {index} lies inside {interval}"
        )
    return array


def rotations(name: str, values: ArrayLike) -> Array:
    """Return ``values`` (..., 3, 3), every matrix a rotation to ROTATION_TOLERANCE."""
    array = finite(name, values, 3, 3)
    error = np.abs(np.swapaxes(array, -1, -2) @ array - np.eye(3)).max(axis=(-2, -1))
    bad = ~((error <= ROTATION_TOLERANCE) & (np.linalg.det(array) > 0.0))
    refuse_where(bad, name, array, "a rotation is needed: orthonormal with determinant +1")
    return array


def transforms(name: str, values: ArrayLike) -> Array:
    """Return ``values`` (..., 4, 4): a rotation, a finite translation, and the row 0 0 0 1."""
    array = finite(name, values, 4, 4)
    bad = (np.abs(array[..., 3, :] - _LAST_ROW) > ROTATION_TOLERANCE).any(axis=-1)
    refuse_where(bad, name, array, "the last row of a transform is 0 0 0 1")
    rotations(f"{name} (rotation)", array[..., :3, :3])
    return array

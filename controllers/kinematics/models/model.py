"""What every model of the arm's shape offers, so that they can be compared."""

from typing import Protocol

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics import checks


class Model(Protocol):
    """A map from chamber lengths to the pose of the tip."""

    @property
    def name(self) -> str:
        """Who published it, for tables."""

    def tip_transform(self, arm: Arm, lengths_m: Array) -> Array:
        """Transform from the twist-free tip frame to the base.

        Args:
            arm: the arm whose chambers they are.
            lengths_m: chamber lengths, ``(..., n_sections, 3)``, m.

        Returns:
            Transforms ``(..., 4, 4)``, translation in m; NaN where the model has no answer.

        Raises:
            InvalidInput: lengths of another shape, or one that is not a positive number.
        """


def checked_lengths(arm: Arm, lengths_m: Array) -> Array:
    """Return the lengths (..., n_sections, 3) as an array.

    A model answers outside Eq. (4) too. Raises InvalidInput, with the index, for another shape
    and for a length that is not above 0 and finite.
    """
    return checks.positive("lengths_m", lengths_m, arm.n_sections, 3, what="a length")


def chained(section_transforms: Array) -> Array:
    """Product over the sections, base first: ``(..., n_sections, 4, 4)`` to ``(..., 4, 4)``."""
    tip = section_transforms[..., 0, :, :]
    for index in range(1, section_transforms.shape[-3]):
        tip = tip @ section_transforms[..., index, :, :]
    return tip


def transforms(rotation: list[list[Array]], position: list[Array]) -> Array:
    """Stack the nine entries of a rotation and three of a position to ``(..., 4, 4)``."""
    result = np.zeros((*np.shape(position[0]), 4, 4))
    for row in range(3):
        for column in range(3):
            result[..., row, column] = rotation[row][column]
        result[..., row, 3] = position[row]
    result[..., 3, 3] = 1.0
    return result

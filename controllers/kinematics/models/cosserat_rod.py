"""A Cosserat rod with its own weight, solved by shooting: the reference of the other models.

Equations and sources: see :mod:`pneuarm.controllers.kinematics.models.rod_integration`. The chamber
lengths say what the arm would be without load: in every section a natural stretch L / l0 and a
natural curvature (u, v) / l0, constant along it, as pressure on the walls and caps of chambers
parallel to the backbone makes them. The rod then gives way to its weight by bending, stretch,
shear and twist. The moment at the base is found by Newton's method, such that none is left at the
tip; where that fails at once, the weight is put on in steps.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths
from pneuarm.controllers.kinematics.models.model import checked_lengths
from pneuarm.controllers.kinematics.models.rod_integration import SectionRod, integrate

Indices = NDArray[np.intp]

_NEWTON_STEPS = 30
#: A moment at the tip below this share of EI / (length of the arm) is none.
_TOLERANCE = 1e-11
#: Step of the difference quotient and longest Newton step, as shares of EI / length.
_DIFFERENCE = 1e-6
_LONGEST_STEP = 1.0
_LOAD_STEPS = 8


@dataclass(frozen=True)
class RodProperties:
    """Stiffness and weight of a rod, counted over its rest length.

    ``bending_n_m2`` EI, ``axial_n`` EA, ``twisting_n_m2`` GJ, ``shear_n`` GA (infinite: none) and
    ``density_kg_m``, mass a metre. Raises InvalidInput for a stiffness that is not above zero or
    a negative or infinite density.
    """

    bending_n_m2: float
    axial_n: float
    density_kg_m: float
    twisting_n_m2: float = np.inf
    shear_n: float = np.inf

    def __post_init__(self) -> None:
        for name in ("bending_n_m2", "axial_n", "twisting_n_m2", "shear_n"):
            if not getattr(self, name) > 0.0:
                raise InvalidInput(f"{name} = {getattr(self, name):g}: it must be above 0")
        if not 0.0 <= self.density_kg_m < np.inf:
            raise InvalidInput(
                f"density_kg_m = {self.density_kg_m:g}: it must be 0 or more, and finite"
            )
        if not np.isfinite(self.bending_n_m2):
            raise InvalidInput(f"bending_n_m2 = {self.bending_n_m2:g}: it must be finite")


def three_springs(
    chamber_offset_m: float, bending_n_m2: float, density_kg_m: float
) -> RodProperties:
    """Return the rod of three equal chambers at ``chamber_offset_m`` from the backbone.

    Three springs of stiffness k (N) resist bending with EI = 3/2 k d^2 and stretch with
    EA = 3 k, so EA = 2 EI / d^2: one number less to identify.
    """
    if not chamber_offset_m > 0.0:
        raise InvalidInput(f"chamber_offset_m = {chamber_offset_m:g}: it must be above 0")
    return RodProperties(bending_n_m2, 2.0 * bending_n_m2 / chamber_offset_m**2, density_kg_m)


@dataclass(frozen=True)
class CosseratRod:
    """The rod behind the interface of :class:`~controllers.kinematics.models.model.Model`.

    Gravity is the arm's. ``steps`` is the number of integration steps a section.
    """

    rod: RodProperties
    steps: int = 24
    name: str = "Cosserat rod"

    def __post_init__(self) -> None:
        """Raise InvalidInput for less than one step."""
        if not self.steps >= 1:
            raise InvalidInput(f"steps = {self.steps}: a section takes 1 step or more")

    def tip_transform(self, arm: Arm, lengths_m: Array) -> Array:
        """Transform from the twist-free tip frame to the base; NaN where no rest is found.

        ``lengths_m`` (..., n_sections, 3) are the chamber lengths without load; returns
        (..., 4, 4). Raises InvalidInput for a wrong shape or a length that is no positive number.
        """
        lengths = checked_lengths(arm, lengths_m)
        shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))
        flat = shapes.reshape(-1, arm.n_sections, 3)
        poses = _Shooting(self, arm, flat).solve()
        return poses.reshape(*lengths.shape[:-2], 4, 4)


class _Shooting:
    """The search for the base moments of a batch of shapes (batch, n_sections, 3)."""

    def __init__(self, model: CosseratRod, arm: Arm, shapes: Array) -> None:
        self._model, self._arm, self._shapes = model, arm, shapes
        self._unit = model.rod.bending_n_m2 / arm.total_rest_length_m

    def solve(self) -> Array:
        """Return the tip poses (batch, 4, 4); NaN where Newton's method does not arrive."""
        everywhere = np.arange(len(self._shapes))
        moments = np.zeros((len(self._shapes), 3))
        poses, found = self._newton(everywhere, moments, 1.0)
        lost = everywhere[~found]
        moments[lost], poses[lost] = 0.0, np.nan
        for share in np.linspace(0.0, 1.0, _LOAD_STEPS + 1)[1:]:
            if lost.size:
                loaded, arrived = self._newton(lost, moments, float(share))
                lost, loaded = lost[arrived], loaded[arrived]
        if lost.size:
            poses[lost] = loaded
        return poses

    def _newton(
        self, which: Indices, moments: Array, load: float
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Improve ``moments`` in place; return poses and whether each one arrived."""
        poses = np.full((len(which), 4, 4), np.nan)
        arrived = np.zeros(len(which), dtype=bool)
        open_ = np.arange(len(which))
        for _ in range(_NEWTON_STEPS):
            rows = which[open_]
            trial = moments[rows] + self._trials()[:, None]
            ends, left = self._shoot(np.tile(rows, 4), trial.reshape(-1, 3), load)
            left = left.reshape(4, len(rows), 3)
            size = np.linalg.norm(left[0], axis=-1)
            poses[open_], arrived[open_] = ends[: len(rows)], size < _TOLERANCE * self._unit
            moving = np.isfinite(left).all(axis=(0, 2)) & ~arrived[open_]
            moments[rows[moving]] += self._correction(left[:, moving])
            open_ = open_[moving]
            if not open_.size:
                break
        return poses, arrived

    def _trials(self) -> Array:
        """Offsets (4, 3) of the base moment: none, and a difference along each axis."""
        return np.vstack([np.zeros(3), _DIFFERENCE * self._unit * np.eye(3)])

    def _correction(self, left: Array) -> Array:
        """Newton's step (batch, 3) from the tip moments (4, batch, 3) of the trials.

        The shortest one where they do not fix it: a rod on the verge of buckling.
        """
        slopes = (left[1:] - left[0]) / (_DIFFERENCE * self._unit)
        jacobian = np.moveaxis(slopes, 0, -1)
        step = -(np.linalg.pinv(jacobian) @ left[0][..., None])[..., 0]
        longest = np.linalg.norm(step, axis=-1, keepdims=True) / (_LONGEST_STEP * self._unit)
        return np.asarray(step / np.maximum(1.0, longest))

    def _shoot(self, rows: Indices, moments: Array, load: float) -> tuple[Array, Array]:
        """Tip poses and tip moments for base moments (m, 3) of the shapes ``rows`` (m,)."""
        pose = np.broadcast_to(np.eye(4), (len(rows), 4, 4))
        for index in range(self._arm.n_sections):
            rod = self._section(index, self._shapes[rows, index], load)
            pose, moments = integrate(rod, pose, moments, self._model.steps)
        return pose, moments

    def _section(self, index: int, shapes: Array, load: float) -> SectionRod:
        rod = self._model.rod
        rests = self._arm.per_section("rest_length_m").reshape(-1)
        weight = load * rod.density_kg_m * np.asarray(self._arm.gravity_m_s2)
        zero = np.zeros(len(shapes))
        return SectionRod(
            length_m=float(rests[index]),
            stretch=shapes[:, 0] / rests[index],
            curvature=np.stack([-shapes[:, 2], shapes[:, 1], zero], axis=-1) / rests[index],
            compliance_force=1.0 / np.array([rod.shear_n, rod.shear_n, rod.axial_n]),
            compliance_moment=1.0
            / np.array([rod.bending_n_m2, rod.bending_n_m2, rod.twisting_n_m2]),
            weight_n_per_m=weight,
            force_below_n=float(rests[index + 1 :].sum()) * weight,
        )

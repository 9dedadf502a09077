"""The equations of a rod integrated along its length, batched, exact for constant strain.

Statics of a Cosserat rod (Antman, *Nonlinear Problems of Elasticity*, 2nd ed. 2005, chapter 8;
for continuum robots: Rucker and Webster, "Statics and dynamics of continuum robots with general
tendon routing and external loading", IEEE T-RO 27(6), 2011): over the unloaded length s

    p' = R v,   R' = R [k]x,   n' = -f,   m' = -p' x n,

with the strains v, k in the rod's own frame and force n, moment m in the base frame. The weight f
is constant along a section and nothing hangs at the tip, so n is known and only m is integrated
with the pose. The steps are those of the commutator-free Lie group method of fourth order
(Celledoni, Marthinsen and Owren, "Commutator-free Lie group methods", FGCS 19, 2003): a rod
without load comes out as an arc to rounding.
"""

from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Array


@dataclass(frozen=True)
class SectionRod:
    """One section of a batch of rods: what it is without load, and how it gives way.

    ``length_m`` is the unloaded section's rest length, over which all is counted. Natural strains
    ``stretch`` (batch,) and ``curvature`` (batch, 3) in 1/m; ``compliance_force`` (3,) in 1/N and
    ``compliance_moment`` (3,) in 1/(N m^2); ``weight_n_per_m`` (3,) and ``force_below_n`` (3,),
    the weight of what hangs beyond the section, in the base frame.
    """

    length_m: float
    stretch: Array
    curvature: Array
    compliance_force: Array
    compliance_moment: Array
    weight_n_per_m: Array
    force_below_n: Array

    def force_n(self, at_m: float) -> Array:
        """Force (3,) that the rod carries at ``at_m`` from the section's base."""
        return self.force_below_n + (self.length_m - at_m) * self.weight_n_per_m

    def strains(self, rotation: Array, moment: Array, at_m: float) -> Array:
        """Strains (batch, 6): v over k, from rotation (batch, 3, 3) and moment (batch, 3)."""
        to_rod = np.swapaxes(rotation, -1, -2)
        linear = (to_rod @ self.force_n(at_m)) * self.compliance_force
        linear[..., 2] += self.stretch
        angular = (to_rod @ moment[..., None])[..., 0] * self.compliance_moment + self.curvature
        return np.concatenate([linear, angular], axis=-1)


def integrate(rod: SectionRod, pose: Array, moment: Array, steps: int) -> tuple[Array, Array]:
    """Pose (batch, 4, 4) and moment (batch, 3) at the section's end, from those at its base."""
    h = rod.length_m / steps
    for index in range(steps):
        pose, moment = _step(rod, pose, moment, index * h, h)
    return pose, moment


def _step(
    rod: SectionRod, pose: Array, moment: Array, at_m: float, h: float
) -> tuple[Array, Array]:
    f1, g1 = _rates(rod, pose, moment, at_m, h)
    second = pose @ motion(0.5 * f1)
    f2, g2 = _rates(rod, second, moment + 0.5 * g1, at_m + 0.5 * h, h)
    f3, g3 = _rates(rod, pose @ motion(0.5 * f2), moment + 0.5 * g2, at_m + 0.5 * h, h)
    f4, g4 = _rates(rod, second @ motion(f3 - 0.5 * f1), moment + g3, at_m + h, h)
    first_half = motion((3.0 * f1 + 2.0 * f2 + 2.0 * f3 - f4) / 12.0)
    second_half = motion((-f1 + 2.0 * f2 + 2.0 * f3 + 3.0 * f4) / 12.0)
    return pose @ first_half @ second_half, moment + (g1 + 2.0 * g2 + 2.0 * g3 + g4) / 6.0


def _rates(
    rod: SectionRod, pose: Array, moment: Array, at_m: float, h: float
) -> tuple[Array, Array]:
    """Strains and change of the moment over a step ``h``."""
    rotation = pose[..., :3, :3]
    strains = rod.strains(rotation, moment, at_m)
    tangent = (rotation @ strains[..., :3, None])[..., 0]
    return h * strains, -h * np.cross(tangent, rod.force_n(at_m))


def motion(screws: Array) -> Array:
    """Rigid motions (..., 4, 4): the exponential of screws (..., 6), translation over rotation."""
    linear, angular = screws[..., :3], screws[..., 3:]
    angle = np.linalg.norm(angular, axis=-1)[..., None, None]
    s = np.sinc(angle / np.pi)
    c = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    small = angle < 1e-2
    safe = np.where(small, 1.0, angle)
    series = (1.0 - angle**2 / 20.0 * (1.0 - angle**2 / 42.0)) / 6.0
    e = np.where(small, series, (1.0 - s) / safe**2)
    cross = _cross_matrices(angular)
    square = cross @ cross
    result = np.zeros((*angular.shape[:-1], 4, 4))
    result[..., :3, :3] = np.eye(3) + s * cross + c * square
    result[..., :3, 3] = ((np.eye(3) + c * cross + e * square) @ linear[..., None])[..., 0]
    result[..., 3, 3] = 1.0
    return result


def _cross_matrices(vectors: Array) -> Array:
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)

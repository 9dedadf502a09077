"""The paper's serial robot and its equations (1), (2) and (3): the reference, not what runs.

The parameters ``(phi, theta, r)`` have no meaning for the straight arm (r is infinite), so the
controllers use :mod:`pneuarm.controllers.kinematics.constant_curvature` in the place of Eq. (1) and
:mod:`pneuarm.controllers.kinematics.jacobians` in that of Eq. (2) and (3), and the tests compare
them. Eq. (4) is a limit: :mod:`pneuarm.controllers.limits.length`.
Everything is defined for batches: ``phi_rad``, ``theta_rad``, ``radius_m`` broadcast to
``(...)``.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.kinematics import checks

Variable = Literal["phi_rad", "theta_rad", "radius_m"]
VARIABLES: tuple[Variable, ...] = ("phi_rad", "theta_rad", "radius_m")


@dataclass(frozen=True)
class Joint:
    """One joint: it turns about, or slides along, ``axis`` in the frame before it.

    ``coupled_with`` is the number (from 1, as the paper counts) of the joint that moves by the
    same variable, or None.
    """

    kind: Literal["revolute", "prismatic"]
    axis: tuple[float, float, float]
    variable: Variable
    coupled_with: int | None = None


#: The paper's Fig. 2: turn to the plane of bending, out to the centre of curvature, turn by the
#: bending angle, and back by the same radius along what is then the radial direction.
CHAIN: tuple[Joint, ...] = (
    Joint("revolute", (0.0, 0.0, 1.0), "phi_rad"),
    Joint("prismatic", (1.0, 0.0, 0.0), "radius_m", coupled_with=4),
    Joint("revolute", (0.0, 1.0, 0.0), "theta_rad"),
    Joint("prismatic", (-1.0, 0.0, 0.0), "radius_m", coupled_with=2),
)


@dataclass(frozen=True)
class ChainFrames:
    """The chain in the base frame: origins ``o1 .. o5`` (..., 5, 3), axes ``z1 .. z4`` (..., 4, 3).

    ``transforms`` (..., 5, 4, 4) are the frames themselves; the last is the tip, Eq. (1).
    """

    origins_m: Array
    axes: Array
    transforms: Array


def _checked(phi_rad: ArrayLike, theta_rad: ArrayLike, radius_m: ArrayLike) -> tuple[Array, ...]:
    phi = checks.finite("phi_rad", phi_rad)
    theta = checks.finite("theta_rad", theta_rad)
    radius = checks.positive("radius_m", radius_m, what="the radius of curvature")
    shape = checks.broadcast(phi_rad=phi, theta_rad=theta, radius_m=radius)
    return tuple(np.broadcast_to(values, shape) for values in (phi, theta, radius))


def skew(vectors: Array) -> Array:
    """Matrices ``(..., 3, 3)`` whose product with a vector is the cross product."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)


def joint_transforms(joint: Joint, values: Array) -> Array:
    """Transforms ``(..., 4, 4)`` of one joint at ``values`` (...), rad or m."""
    axis = np.array(joint.axis)
    transforms = np.broadcast_to(np.eye(4), (*values.shape, 4, 4)).copy()
    if joint.kind == "prismatic":
        transforms[..., :3, 3] = values[..., None] * axis
    else:  # Rodrigues
        turn, angle = skew(axis), values[..., None, None]
        transforms[..., :3, :3] += np.sin(angle) * turn + (1.0 - np.cos(angle)) * (turn @ turn)
    return transforms


def chain_frames(phi_rad: ArrayLike, theta_rad: ArrayLike, radius_m: ArrayLike) -> ChainFrames:
    """Frames of the chain before each joint and at the tip, as the product of its transforms.

    Raises InvalidInput for a radius that is not above 0 and for anything that is not finite.
    """
    values = dict(zip(VARIABLES, _checked(phi_rad, theta_rad, radius_m), strict=True))
    frames = [np.broadcast_to(np.eye(4), (*values["phi_rad"].shape, 4, 4))]
    for joint in CHAIN:
        frames.append(frames[-1] @ joint_transforms(joint, values[joint.variable]))
    axes = [
        frame[..., :3, :3] @ np.array(joint.axis)
        for frame, joint in zip(frames, CHAIN, strict=False)
    ]
    transforms = np.stack(frames, axis=-3)
    return ChainFrames(transforms[..., :3, 3], np.stack(axes, axis=-2), transforms)


def chain_transform(phi_rad: ArrayLike, theta_rad: ArrayLike, radius_m: ArrayLike) -> Array:
    """Transform ``(..., 4, 4)`` from the paper's tip frame to the base: Eq. (1) as a product."""
    return chain_frames(phi_rad, theta_rad, radius_m).transforms[..., -1, :, :]


def paper_transform(phi_rad: ArrayLike, theta_rad: ArrayLike, radius_m: ArrayLike) -> Array:
    """Transform ``(..., 4, 4)`` from the paper's tip frame to the base: Eq. (1) as printed.

    Raises InvalidInput as :func:`chain_frames`.
    """
    phi, theta, radius = _checked(phi_rad, theta_rad, radius_m)
    cp, sp, ct, st = np.cos(phi), np.sin(phi), np.cos(theta), np.sin(theta)
    zero, one = np.zeros_like(cp), np.ones_like(cp)
    return _matrix(
        [cp * ct, -sp, cp * st, radius * cp * (1.0 - ct)],
        [sp * ct, cp, sp * st, radius * sp * (1.0 - ct)],
        [-st, zero, ct, radius * st],
        [zero, zero, zero, one],
    )


def _matrix(*rows: list[Array]) -> Array:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def velocity_jacobian(phi_rad: ArrayLike, theta_rad: ArrayLike, radius_m: ArrayLike) -> Array:
    """Jacobian ``(..., 6, 3)`` of the tip twist over ``(phi, theta, r)``: Eq. (2) as printed.

    Rows: velocity (m/s) over angular velocity (rad/s), in the base frame.
    """
    phi, theta, radius = _checked(phi_rad, theta_rad, radius_m)
    cp, sp, ct, st = np.cos(phi), np.sin(phi), np.cos(theta), np.sin(theta)
    zero, one = np.zeros_like(cp), np.ones_like(cp)
    return _matrix(
        [-radius * sp * (1.0 - ct), radius * cp * st, cp * (1.0 - ct)],
        [radius * cp * (1.0 - ct), radius * sp * st, sp * (1.0 - ct)],
        [zero, radius * ct, st],
        [zero, -sp, zero],
        [zero, cp, zero],
        [one, zero, zero],
    )


def propagated_jacobian(phi_rad: ArrayLike, theta_rad: ArrayLike, radius_m: ArrayLike) -> Array:
    """Eq. (2) as it is derived: velocities propagated from joint to joint, ``(..., 6, 3)``.

    Each frame carries the velocity and the angular velocity of the one before, in its own
    coordinates; a revolute joint adds a turn, a prismatic one a slide. The columns are unit rates
    of ``(phi, theta, r)``; the coupled joints slide together.
    """
    values = dict(zip(VARIABLES, _checked(phi_rad, theta_rad, radius_m), strict=True))
    shape = values["phi_rad"].shape
    velocity, spin = np.zeros((*shape, 3, 3)), np.zeros((*shape, 3, 3))
    turned = np.eye(3)
    for joint in CHAIN:
        step = joint_transforms(joint, values[joint.variable])
        rotation, back = step[..., :3, :3], np.swapaxes(step[..., :3, :3], -1, -2)
        rate = np.outer(joint.axis, [name == joint.variable for name in VARIABLES])
        velocity = back @ (velocity - skew(step[..., :3, 3]) @ spin)
        spin = back @ spin
        if joint.kind == "revolute":
            spin = spin + rate
        else:
            velocity = velocity + rate
        turned = turned @ rotation
    return np.concatenate([turned @ velocity, turned @ spin], axis=-2)


def serial_jacobian(phi_rad: ArrayLike, theta_rad: ArrayLike, radius_m: ArrayLike) -> Array:
    """Jacobian ``(..., 6, 3)`` from axes and origins of the chain, modified: Eq. (3).

    The columns of joints that are coupled add up in the column of their one variable.
    """
    frames = chain_frames(phi_rad, theta_rad, radius_m)
    tip = frames.origins_m[..., 4, :]
    jacobian = np.zeros((*tip.shape[:-1], 6, 3))
    for index, joint in enumerate(CHAIN):
        axis, column = frames.axes[..., index, :], VARIABLES.index(joint.variable)
        if joint.kind == "prismatic":
            jacobian[..., :3, column] += axis
        else:
            jacobian[..., :3, column] += np.cross(axis, tip - frames.origins_m[..., index, :])
            jacobian[..., 3:, column] += axis
    return jacobian

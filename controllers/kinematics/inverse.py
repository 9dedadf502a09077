"""Inverse kinematics of the whole configuration from a tip pose, with what the pose lacks.

One section has three freedoms and a pose six: the position alone gives the one arc that ends there,
exactly; the residual is what the orientation misses. Several sections are solved by damped least
squares (Levenberg-Marquardt) with the lengths kept inside the limits, from several starts at once.
The lengths returned are always ones that the arm can take; the residual says how far that is.
"""

from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.geometry.rotations import rotation_vectors
from pneuarm.controllers.kinematics import checks
from pneuarm.controllers.kinematics.constant_curvature import (
    lengths_from_shapes,
    section_inverse,
    shapes_from_lengths,
    tip_transform,
)
from pneuarm.controllers.kinematics.jacobians import jacobians, shape_rates
from pneuarm.controllers.kinematics.parameters import Frame, in_frame

#: Steps at most; from a good start ten do.
_STEPS = 100
#: Starts for several sections: the arm at rest and random shapes, the same ones every time; a pose
#: that no start has met gets as many again, this many rounds.
_STARTS = 8
_ROUNDS = 8
_SEED = 20
#: Met well enough to look for no better start (m, as below).
_CLOSE_M = 1e-9
#: A pose is met at this residual (m, angles times the arm's length): there is nothing to improve.
_MET_M = 1e-13
#: Below this theta^2 the direction of bending counts as standing still.
_STRAIGHT_RAD2 = 1e-12


@dataclass(frozen=True)
class Inverse:
    """Lengths for tip poses and how far from the poses they end.

    ``lengths_m`` (..., n_sections, 3), within the limits; ``position_residual_m`` (...) and
    ``rotation_residual_rad`` (...): distance and angle between the pose asked for and the tip.
    """

    lengths_m: Array
    position_residual_m: Array
    rotation_residual_rad: Array


def inverse(arm: Arm, transform: ArrayLike, frame: Frame = "twist_free") -> Inverse:
    """Lengths whose tip is nearest to poses ``(..., 4, 4)``, tip to base, of the named tip frame.

    Nearest weighs an angle (rad) with the arm's rest length (m). Exact for one section where the
    position is within the limits: the residual is then the angle alone. Raises InvalidInput, with
    the index, for a matrix that is no rotation and for a pose that is not finite.
    """
    checks.one_of("frame", frame, get_args(Frame))
    poses = checks.transforms("transform", transform)
    flat = poses.reshape(-1, 4, 4)
    solve = _one_section if arm.n_sections == 1 else _several_sections
    lengths = solve(arm, flat, frame)
    residual = pose_error(arm, lengths, flat, frame)
    batch = poses.shape[:-2]
    return Inverse(
        lengths.reshape(*batch, arm.n_sections, 3),
        np.linalg.norm(residual[:, :3], axis=-1).reshape(batch),
        np.linalg.norm(residual[:, 3:], axis=-1).reshape(batch),
    )


def within_limits(arm: Arm, lengths_m: Array) -> Array:
    """Move lengths ``(..., n_sections, 3)`` inside Eq. (4), then unbend what bends too far.

    Unbending moves a length toward the mean of its section, so Eq. (4) holds after it.
    """
    lengths = np.clip(lengths_m, *arm.length_interval_m)
    offset, most = arm.per_section("chamber_offset_m"), arm.per_section("bend_max_rad")
    shapes = shapes_from_lengths(lengths, offset)
    theta = np.hypot(shapes[..., 1:2], shapes[..., 2:3])
    bent = theta > most
    shapes[..., 1:] *= np.where(bent, most / np.where(bent, theta, 1.0), 1.0)
    return np.where(bent, lengths_from_shapes(shapes, offset), lengths)


def pose_error(arm: Arm, lengths_m: Array, poses: Array, frame: Frame = "twist_free") -> Array:
    """Offset (m) over rotation vector (rad), ``(..., 6)``, from the tip to the pose, base axes."""
    tips = tip_transform(arm, lengths_m)
    if frame == "paper":
        last = shapes_from_lengths(lengths_m, arm.per_section("chamber_offset_m"))[..., -1, :]
        tips = in_frame(tips, last, frame)
    turn = rotation_vectors(poses[..., :3, :3] @ np.swapaxes(tips[..., :3, :3], -1, -2))
    return np.concatenate([poses[..., :3, 3] - tips[..., :3, 3], turn], axis=-1)


def _one_section(arm: Arm, poses: Array, frame: Frame) -> Array:
    """Lengths (m, 1, 3): exact from the position, or the nearest to the pose within the limits."""
    offset = arm.per_section("chamber_offset_m")
    reachable = (poses[:, 2, 3] > 0.0) | (np.hypot(poses[:, 0, 3], poses[:, 1, 3]) > 0.0)
    places = np.where(reachable[:, None], poses[:, :3, 3], (0.0, 0.0, arm.total_rest_length_m))
    exact = lengths_from_shapes(section_inverse(places)[:, None, :], offset)
    lengths = within_limits(arm, exact)
    outside = ~reachable | (np.abs(lengths - exact) > 0.0).any(axis=(-2, -1))
    if outside.any():
        lengths[outside] = _least_squares(arm, poses[outside], lengths[outside], frame)
    return lengths


def _several_sections(arm: Arm, poses: Array, frame: Frame) -> Array:
    """Lengths (m, n_sections, 3): the best over the starts; unmet poses get more of them."""
    best = np.broadcast_to(arm.rest_lengths_m, (len(poses), arm.n_sections, 3)).copy()
    cost = np.full(len(poses), np.inf)
    rng = np.random.default_rng(_SEED)
    for _ in range(_ROUNDS):
        unmet = np.flatnonzero(cost > _CLOSE_M**2)
        if not unmet.size:
            break
        starts = _starts(arm, rng)
        every = np.repeat(poses[unmet], len(starts), axis=0)
        lengths = _least_squares(arm, every, np.tile(starts, (unmet.size, 1, 1)), frame)
        costs = _cost(pose_error(arm, lengths, every, frame), _weights(arm))
        costs = costs.reshape(unmet.size, -1)
        chosen = np.arange(unmet.size) * len(starts) + costs.argmin(axis=-1)
        better = costs.min(axis=-1) < cost[unmet]
        cost[unmet[better]] = costs.min(axis=-1)[better]
        best[unmet[better]] = lengths[chosen[better]]
    return best


def _starts(arm: Arm, rng: np.random.Generator) -> Array:
    """Shapes to start from, as lengths (starts, n_sections, 3): at rest, and bent every way."""
    shapes = np.zeros((_STARTS, arm.n_sections, 3))
    low, high = arm.per_section("length_min_m")[:, 0], arm.per_section("length_max_m")[:, 0]
    shapes[..., 0] = rng.uniform(
        0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high, shapes.shape[:2]
    )
    bends = rng.uniform(-0.6, 0.6, (_STARTS, arm.n_sections, 2))
    shapes[..., 1:] = bends * arm.per_section("bend_max_rad")
    shapes[0, :, 0], shapes[0, :, 1:] = arm.rest_lengths_m[:, 0], 0.0
    return within_limits(arm, lengths_from_shapes(shapes, arm.per_section("chamber_offset_m")))


def _weights(arm: Arm) -> Array:
    return np.repeat([1.0, arm.total_rest_length_m], 3)


def _cost(errors: Array, weights: Array) -> Array:
    """Squared weighted length (...) of errors ``(..., 6)``, m^2."""
    cost: Array = np.square(errors * weights).sum(axis=-1)
    return cost


def _least_squares(arm: Arm, poses: Array, lengths: Array, frame: Frame) -> Array:
    """Levenberg-Marquardt from ``lengths`` (m, n_sections, 3), each configuration on its own.

    A step is projected on the limits and taken if it lowers the cost; the damping follows.
    """
    weights, lengths = _weights(arm), lengths.copy()
    errors = pose_error(arm, lengths, poses, frame)
    cost, damping = _cost(errors, weights), np.full(len(poses), 1e-3)
    for _ in range(_STEPS):
        active = (cost > _MET_M**2) & (damping < 1e8)
        if not active.any():
            break
        trial = _trial(arm, lengths[active], errors[active], damping[active], frame)
        trial_errors = pose_error(arm, trial, poses[active], frame)
        trial_cost = _cost(trial_errors, weights)
        better = trial_cost < cost[active]
        chosen = np.flatnonzero(active)[better]
        lengths[chosen], errors[chosen], cost[chosen] = (
            trial[better],
            trial_errors[better],
            trial_cost[better],
        )
        damping[active] *= np.where(better, 0.1, 10.0)
        damping = np.maximum(damping, 1e-12)
    return lengths


def _trial(arm: Arm, lengths: Array, errors: Array, damping: Array, frame: Frame) -> Array:
    """Lengths one damped step on, within the limits; all (m, ...)."""
    weights = _weights(arm)
    scaled = weights[:, None] * _frame_jacobian(arm, lengths, frame)
    squared = np.swapaxes(scaled, -1, -2) @ scaled
    scale = np.trace(squared, axis1=-2, axis2=-1) / arm.n_chambers
    squared += (damping * scale)[:, None, None] * np.eye(arm.n_chambers)
    gradient = np.einsum("mij,mi->mj", scaled, errors * weights)
    step = np.linalg.solve(squared, gradient[..., None])[..., 0]
    return within_limits(arm, lengths + step.reshape(lengths.shape))


def _frame_jacobian(arm: Arm, lengths: Array, frame: Frame) -> Array:
    """Base Jacobian (m, 6, n_chambers) of the tip with the angular rows of the named frame.

    The paper's frame turns by phi_dot of the last section about its own z more than the twist-free.
    """
    jacobian = jacobians(arm, lengths)
    if frame == "paper":
        offset = arm.sections[-1].chamber_offset_m
        u, v = np.moveaxis(shapes_from_lengths(lengths[:, -1], offset)[:, 1:], -1, 0)
        safe = np.maximum(u * u + v * v, _STRAIGHT_RAD2)
        phi_rates = np.stack([np.zeros_like(u), -v / safe, u / safe], axis=-1) @ shape_rates(offset)
        axis = tip_transform(arm, lengths)[:, :3, 2]
        jacobian[:, 3:, -3:] += axis[:, :, None] * phi_rates[:, None, :]
    return jacobian

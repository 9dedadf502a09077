"""The tasks in CasADi symbols: errors, velocities and Jacobians over the chamber lengths."""

from collections.abc import Mapping
from typing import NamedTuple

import casadi as ca

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.geometry.rotations import symbolic_angle_vector, symbolic_rotation_vector
from pneuarm.controllers.kinematics.compiled import symbolic_tip
from pneuarm.controllers.tasks.wanted import ORIENTATION_LENGTH_M

Parts = Mapping[str, ca.SX]


class Rows(NamedTuple):
    """Weighted rows of all tasks but the chambers': every one in metres.

    ``error`` (m,), ``velocity`` (m,) of what is wanted, m/s, and ``jacobian`` (m, n_chambers).
    ``error_m`` is how far the tasks are from done, without their weights. ``transform`` (4, 4) and
    ``tip_jacobian`` (6, n_chambers) are the model's tip, uncorrected.
    """

    error: ca.SX
    velocity: ca.SX
    jacobian: ca.SX
    error_m: ca.SX
    transform: ca.SX
    tip_jacobian: ca.SX


def symbolic_rows(arm: Arm, lengths: ca.SX, want: Parts, whole: bool) -> Rows:
    """Rows of what is wanted at ``lengths`` (n_chambers,).

    Without ``whole`` only the tip's position counts: half the arithmetic, and the usual case.
    """
    position, rotation, jacobian = symbolic_tip(arm, lengths)
    seen, turned = position + want["offset_m"], want["turn"] @ rotation
    linear, angular = _velocities(want, seen, turned)
    miss = want["position_follows"] * (want["position_m"] - seen)
    weight = ca.sqrt(want["position_weight"])
    blocks = [(weight * miss, weight * linear, weight * jacobian[:3, :])]
    squared = _counted(want["position_weight"], miss)
    if whole:
        turn = ORIENTATION_LENGTH_M * _orientation_error(want, turned)
        weight = ca.sqrt(want["orientation_weight"])
        free = want["direction_follows"] * turned[:, 2] @ turned[:, 2].T
        spin = ORIENTATION_LENGTH_M * weight * (want["turn"] @ jacobian[3:, :])
        blocks.append((weight * turn, ORIENTATION_LENGTH_M * weight * angular, spin - free @ spin))
        offset, carried = _point(arm, lengths, want)
        weight = ca.sqrt(want["point_weight"])
        blocks.append((weight * offset, ca.SX(3, 1), weight * carried))
        squared += _counted(want["orientation_weight"], turn)
        squared += _counted(want["point_weight"], offset)
    chambers = ca.norm_inf(want["lengths_m"] - lengths) * (want["lengths_weight"] > 0)
    transform = ca.vertcat(ca.horzcat(rotation, position), ca.DM([[0.0, 0.0, 0.0, 1.0]]))
    error, velocity, moves = (ca.vertcat(*parts) for parts in zip(*blocks, strict=True))
    return Rows(
        error,
        velocity,
        moves,
        ca.fmax(ca.sqrt(squared), chambers),
        transform,
        jacobian,
    )


def _counted(weight: ca.SX, error: ca.SX) -> ca.SX:
    return (weight > 0) * ca.sumsqr(error)


def _velocities(want: Parts, position: ca.SX, rotation: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Linear velocity of the tip and angular velocity that are asked for, in the base frame."""
    frame = ca.SX.eye(3) + want["in_tip_frame"] * (rotation - ca.SX.eye(3))
    angular = frame @ want["angular_rad_s"]
    carried = want["about_base_origin"] * ca.cross(angular, position)
    return frame @ want["velocity_m_s"] + carried, angular


def _orientation_error(want: Parts, rotation: ca.SX) -> ca.SX:
    """Rotation vector (3,), rad, from the tip to the rotation or to the direction wanted."""
    axis = rotation[:, 2]
    across, along = ca.cross(axis, want["direction"]), ca.dot(axis, want["direction"])
    # Exactly the other way round every axis across is as good: the tip's own x.
    pointing = symbolic_angle_vector(across, along, rotation[:, 0])
    whole = want["rotation"] @ rotation.T
    return (
        want["rotation_follows"] * symbolic_rotation_vector(whole)
        + want["direction_follows"] * pointing
    )


def _point(arm: Arm, lengths: ca.SX, want: Parts) -> tuple[ca.SX, ca.SX]:
    """Offset (3,) of the backbone's point from where it should be, and its Jacobian."""
    along = arm.n_sections * want["station"]
    shares = [ca.fmin(ca.fmax(along - index, 0.0), 1.0) for index in range(arm.n_sections)]
    position, _, jacobian = symbolic_tip(arm, lengths, shares)
    return want["point_m"] - position, jacobian[:3, :]

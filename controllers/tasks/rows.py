"""What is wanted in CasADi symbols: errors, velocities and Jacobians over the chamber lengths."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import casadi as ca

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.geometry.rotations import symbolic_angle_vector, symbolic_rotation_vector
from pneuarm.controllers.kinematics.compiled import symbolic_tip
from pneuarm.controllers.tasks.wanted import ORIENTATION_LENGTH_M

Parts = Mapping[str, ca.SX]


class Block(NamedTuple):
    """Rows that go together, weighted: error (k,), velocity wanted (k,), Jacobian; in metres.

    ``squared`` (m^2) is the squared error without the weight, where it counts.
    """

    error: ca.SX
    velocity: ca.SX
    jacobian: ca.SX
    squared: ca.SX


def block(weight: ca.SX, error: ca.SX, velocity: ca.SX, jacobian: ca.SX) -> Block:
    """Weigh rows in metres."""
    root = ca.sqrt(weight)
    return Block(root * error, root * velocity, root * jacobian, _counted(weight, error))


#: What gives the rows of one kind of target over the lengths (n_chambers,), None for none.
RowsOf = Callable[[Arm, ca.SX, Parts], Block | None]


class Rows(NamedTuple):
    """Weighted rows of all that is wanted but the chambers': every one in metres.

    ``error`` (m,), ``velocity`` (m,) of what is wanted, m/s, and ``jacobian`` (m, n_chambers).
    ``error_m`` is how far it is from done, without their weights. ``transform`` (4, 4) and
    ``tip_jacobian`` (6, n_chambers) are the model's tip, uncorrected.
    """

    error: ca.SX
    velocity: ca.SX
    jacobian: ca.SX
    error_m: ca.SX
    transform: ca.SX
    tip_jacobian: ca.SX


def symbolic_rows(
    arm: Arm, lengths: ca.SX, want: Parts, own: Sequence[RowsOf], whole: bool
) -> Rows:
    """Rows of what is wanted at ``lengths`` (n_chambers,), with those of single kinds, ``own``.

    Without ``whole`` only the tip's position counts: half the arithmetic, and the usual case.
    """
    position, rotation, jacobian = symbolic_tip(arm, lengths)
    seen, turned = position + want["offset_m"], want["turn"] @ rotation
    linear, angular = _velocities(want, seen, turned)
    miss = want["position_follows"] * (want["position_m"] - seen)
    blocks = [block(want["position_weight"], miss, linear, jacobian[:3, :])]
    if whole:
        blocks.append(_orientation(want, turned, angular, jacobian[3:, :]))
        blocks += [rows for rows_of in own if (rows := rows_of(arm, lengths, want)) is not None]
    chambers = ca.norm_inf(want["lengths_m"] - lengths) * (want["lengths_weight"] > 0)
    error, velocity, moves, squared = zip(*blocks, strict=True)
    return Rows(
        ca.vertcat(*error),
        ca.vertcat(*velocity),
        ca.vertcat(*moves),
        ca.fmax(ca.sqrt(sum(squared, ca.SX(0))), chambers),
        ca.vertcat(ca.horzcat(rotation, position), ca.DM([[0.0, 0.0, 0.0, 1.0]])),
        jacobian,
    )


def _orientation(want: Parts, turned: ca.SX, angular: ca.SX, jacobian: ca.SX) -> Block:
    """Rows of the tip's rotation, in metres; where it points alone leaves out the axis itself."""
    turn = ORIENTATION_LENGTH_M * _orientation_error(want, turned)
    weight = want["orientation_weight"]
    root = ca.sqrt(weight)
    free = want["direction_follows"] * turned[:, 2] @ turned[:, 2].T
    spin = ORIENTATION_LENGTH_M * root * (want["turn"] @ jacobian)
    rate = ORIENTATION_LENGTH_M * root * angular
    return Block(root * turn, rate, spin - free @ spin, _counted(weight, turn))


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

"""The trajectory that is sent, with what was learnt of it."""

from pathlib import Path

import numpy as np

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.learning.course import Course
from pneuarm.controllers.targets.trajectory import TrajectoryTarget
from pneuarm.hardware.tables.table import MM
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.target_messages import trajectory_target
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.learning.drive import bound_m
from pneuarm.service.learning.file import configuration_digest, load
from pneuarm.service.wire.target_checks import TargetChecker


def checked(configuration: Configuration, message: pb.Target) -> TrajectoryTarget:
    """Return the trajectory of a message, checked as the daemon does; raises TargetRejected."""
    checker = TargetChecker(configuration.build_arm(), reference=configuration.reference.limits())
    target = checker.target(message)
    if not isinstance(target, TrajectoryTarget):
        raise InvalidInput(f"a {target.name} cannot be learnt; a trajectory can")
    return target


def with_learned(message: pb.Target, path: Path, configuration: Configuration) -> pb.Target:
    """Return a trajectory's message with the offsets of a file added.

    Raises InvalidInput where the file is of another arm, configuration or trajectory, or where its
    offsets are larger than the daemon's configuration allows.
    """
    learned, course = load(path), Course(checked(configuration, message))
    for what, there, here in (
        ("arm", learned.arm, configuration.arm.name),
        ("trajectory", learned.trajectory_sha256, course.digest),
        ("configuration", learned.configuration_sha256, configuration_digest(configuration)),
    ):
        if there != here:
            raise InvalidInput(
                f"{path} was learnt with another {what} than is used now, so it would lead the tip "
                "astray: learn the trajectory again, or send it without --learned"
            )
    largest_m = float(np.linalg.norm(learned.offset_m, axis=1).max())
    if largest_m > bound_m(configuration) + 1e-6:
        raise InvalidInput(
            f"{path} moves the tip by {largest_m / MM:.1f} mm; feedback.learned_max_share allows "
            f"{bound_m(configuration) / MM:.1f} mm"
        )
    sent = course.shifted_at_waypoints(learned.offset_m)
    shape_id, law = message.trajectory.id, message.law
    return trajectory_target(zip(sent.times_s, sent.positions_m, strict=True), shape_id, law)

"""Circle, line and trajectory from the prompt: millimetres; a trajectory is a file."""

import argparse
import secrets

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.target_messages import circle_target, line_target, trajectory_target
from pneuarm.service.learning.waypoints import read_waypoints

MM = 1e-3


def shape_of(arguments: argparse.Namespace, law: "pb.Law") -> pb.Target:
    """Return the target of `send circle`, `send line` or `send trajectory`, run for once."""
    shape_id = secrets.randbelow(2**16)  # so that the same shape can be sent twice
    if arguments.kind == "trajectory":
        return trajectory_target(read_waypoints(arguments.file), shape_id, law)
    values = [MM * value for value in arguments.values]
    if arguments.kind == "circle":
        normal = arguments.normal
        center, radius = values[:3], values[3]
        return circle_target(
            center, radius, arguments.frequency, arguments.turns, normal, shape_id, law
        )
    return line_target(values[:3], values[3:], arguments.period, arguments.repeats, shape_id, law)


def duration_s(target: pb.Target) -> float:
    """Time that a shape takes; 0 for targets that take none of their own."""
    match target.WhichOneof("target"):
        case "circle":
            return target.circle.turns / target.circle.frequency_hz
        case "line":
            return target.line.repeats * target.line.period_s
        case "trajectory":
            return target.trajectory.waypoints[-1].time_s
    return 0.0

"""Circle, line and trajectory from the prompt: millimetres, and a file of waypoints."""

import argparse
import math
import secrets
from pathlib import Path

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.target_messages import circle_target, line_target, trajectory_target
from pneuarm.service.configuration.text_file import read_text

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


def read_waypoints(path: Path) -> list[tuple[float, list[float]]]:
    """Read lines of time (s) and position (mm), separated by commas or blanks.

    Lines that begin with # are left out. Raises InvalidInput with the line that is wrong.
    """
    waypoints = []
    for number, line in enumerate(read_text(path).splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            time_s, x, y, z = _finite(line)
        except ValueError:
            raise InvalidInput(
                f"{path}, line {number}: {line[:80]!r}; four numbers are needed: time in s, then "
                "x y z in mm"
            ) from None
        waypoints.append((time_s, [MM * x, MM * y, MM * z]))
    if not waypoints:
        raise InvalidInput(f"{path} holds no waypoints; a line is: time in s, then x y z in mm")
    return waypoints


def _finite(line: str) -> list[float]:
    """Numbers of a line; raises ValueError for what is none, or not finite."""
    values = [float(word) for word in line.replace(",", " ").split()]
    if not all(map(math.isfinite, values)):
        raise ValueError
    return values

"""Shapes from the wire: checked for order, limits and reach, and made from plain numbers."""

import math
import zlib
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import TargetRejected
from pneuarm.controllers.reference.trajectory import ReferenceLimits
from pneuarm.controllers.targets.shapes import Circle, Line, Shape, Waypoints, perpendicular
from pneuarm.controllers.targets.targets import CircleTarget, LawName, LineTarget, TrajectoryTarget
from pneuarm.controllers.workspace.workspace import Workspace
from pneuarm.logs.schema import pneuarm_pb2 as pb

MAX_WAYPOINTS = 200
_SAMPLES = 400
_SHORTEST_S = 0.01
_LONGEST_S = 3600.0

Position = Callable[[str, object], Array]
Checked = TrajectoryTarget | CircleTarget | LineTarget
Triple = tuple[float, float, float]


class ShapeChecker:
    """Makes shape targets for one arm; ``position`` checks a frame and a point in it."""

    def __init__(self, arm: Arm, limits: ReferenceLimits, position: Position) -> None:
        self._position, self._limits = position, limits
        tool = any(arm.tool_m)
        self._workspace = Workspace(arm) if arm.n_sections == 1 and not tool else None
        self._passed: int | None = None

    def target(self, message: pb.Target, law: LawName) -> Checked:
        """Check a trajectory, circle or line; raises TargetRejected with one sentence."""
        kind = message.WhichOneof("target") or ""
        own = getattr(message, kind)
        key = zlib.crc32(own.SerializeToString(deterministic=True)) | (int(own.id) & 0xFFFF) << 32
        if kind == "trajectory":
            target: Checked = TrajectoryTarget(self._waypoints(message.trajectory), key, law)
        elif kind == "circle":
            target = CircleTarget(self._circle(message.circle), key, law)
        else:
            target = LineTarget(self._line(message.line), key, law)
        if key != self._passed:  # the same shape comes again and again
            self._check_reach(target.shape)
            self._check_limits(target.shape)
            self._passed = key
        return target

    def _waypoints(self, message: pb.TrajectoryTarget) -> Waypoints:
        count = len(message.waypoints)
        if not 2 <= count <= MAX_WAYPOINTS:
            raise TargetRejected(f"{count} waypoints; 2 to {MAX_WAYPOINTS} are needed")
        times = [point.time_s for point in message.waypoints]
        if not (math.isfinite(sum(times)) and times[0] >= 0.0 and times[-1] <= _LONGEST_S):
            raise TargetRejected(f"time_s of the waypoints: 0 to {_LONGEST_S:g} s are allowed")
        for index, (before, after) in enumerate(pairwise(times), 2):
            if after - before < _SHORTEST_S:
                raise TargetRejected(
                    f"waypoint {index} is at {after:g} s, waypoint {index - 1} at {before:g} s; "
                    f"times must increase by {_SHORTEST_S:g} s or more"
                )
        points = tuple(
            _triple(self._position(message.frame_id, point.position_m))
            for point in message.waypoints
        )
        return Waypoints(tuple(times), points)

    def _circle(self, message: pb.CircleTarget) -> Circle:
        center = self._position(message.frame_id, message.center_m)
        normal = np.array([0.0, 0.0, 1.0])
        if message.HasField("normal"):
            normal = np.array([message.normal.x, message.normal.y, message.normal.z])
        if not np.isfinite(normal).all() or np.linalg.norm(normal) < 1e-9:
            raise TargetRejected(f"normal = {normal.tolist()}: a vector of some length is needed")
        _positive("radius_m", message.radius_m)
        _positive("frequency_hz", message.frequency_hz)
        first, second = perpendicular(normal)
        return Circle(
            _triple(center),
            _triple(first),
            _triple(second),
            message.radius_m,
            message.frequency_hz,
            _times("turns", message.turns),
        )

    def _line(self, message: pb.LineTarget) -> Line:
        start = self._position(message.frame_id, message.start_m)
        end = self._position(message.frame_id, message.end_m)
        _positive("period_s", message.period_s)
        repeats = _times("repeats", message.repeats)
        return Line(_triple(start), _triple(end), message.period_s, repeats)

    def _check_reach(self, shape: Shape) -> None:
        """Refuse a shape with a point out of reach: which one, and the nearest that is not."""
        if self._workspace is None:
            return
        if isinstance(shape, Waypoints):
            points = np.array(shape.positions_m)
            names = [f"waypoint {index + 1}" for index in range(len(points))]
        else:
            times = np.linspace(0.0, min(_span_s(shape), shape.duration_s), 73)
            points = np.array([shape.at(time).position for time in times])
            names = [f"the point at {time:.3g} s" for time in times]
        outside = np.flatnonzero(~self._workspace.contains(points))
        if len(outside):
            answer = self._workspace.is_reachable(points[outside[0]])
            raise TargetRejected(
                f"{names[outside[0]]} at {_mm(points[outside[0]])} is out of reach; the nearest "
                f"reachable point is {_mm(answer.nearest_m)}, {1e3 * answer.distance_m:.1f} mm away"
            )

    def _check_limits(self, shape: Shape) -> None:
        """Refuse a shape that moves faster than the reference may along an axis."""
        share = 0.98 * 3.0**-0.5
        if isinstance(shape, Waypoints):
            times = np.linspace(shape.times_s[0], shape.times_s[-1], _SAMPLES)
        else:
            times = np.linspace(0.0, _span_s(shape), _SAMPLES)
        motions = [shape.at(float(time)) for time in times]
        speed = np.abs([motion.velocity for motion in motions]).max()
        force = np.abs([motion.acceleration for motion in motions]).max()
        for name, unit, largest, allowed in (
            ("speed_max_mm_s", "mm/s", speed, share * self._limits.speed_m_s),
            ("acceleration_max_mm_s2", "mm/s^2", force, share * self._limits.acceleration_m_s2),
        ):
            if largest > allowed:
                raise TargetRejected(
                    f"the shape needs {1e3 * largest:.0f} {unit} along an axis; allowed are "
                    f"{1e3 * allowed:.0f} (reference.{name} over the root of three): give it more "
                    "time"
                )


def _span_s(shape: Shape) -> float:
    """Time of one turn, or of one way there and back."""
    if isinstance(shape, Circle):
        return 1.0 / shape.frequency_hz
    return shape.period_s if isinstance(shape, Line) else shape.duration_s


def _triple(values: Array) -> Triple:
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def _positive(name: str, value: float) -> None:
    if not 0.0 < value < math.inf:
        raise TargetRejected(f"{name} = {value:g}: it must be finite and above 0")


def _times(name: str, value: float) -> float:
    if not 0.0 <= value < math.inf:
        raise TargetRejected(f"{name} = {value:g}: 0 (without end) or more")
    return value or math.inf


def _mm(point: Array) -> str:
    return "(" + ", ".join(f"{1e3 * value:.1f}" for value in point) + ") mm"

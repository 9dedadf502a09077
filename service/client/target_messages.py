"""Target messages made from plain numbers, SI units, for programs and for the command line."""

from collections.abc import Iterable, Sequence

from pneuarm.logs.schema import pneuarm_pb2 as pb

Vector = Sequence[float]


def _vector(values: Vector) -> pb.Vector3:
    x, y, z = (float(value) for value in values)
    return pb.Vector3(x=x, y=y, z=z)


def position_target(
    position_m: Vector, law: "pb.Law" = pb.DEFAULT, velocity_m_s: Vector | None = None
) -> pb.Target:
    """Make a target: the tip at a position (3,) in the base frame, m, that moves or not."""
    position = pb.PositionTarget(
        frame_id="base",
        position_m=_vector(position_m),
        velocity_m_s=None if velocity_m_s is None else _vector(velocity_m_s),
    )
    return pb.Target(position=position, law=law)


def pose_target(
    position_m: Vector, quaternion_xyzw: Vector, law: "pb.Law" = pb.DEFAULT
) -> pb.Target:
    """Make a target: the tip at a pose in the base frame."""
    x, y, z, w = (float(value) for value in quaternion_xyzw)
    pose = pb.PoseTarget(
        frame_id="base",
        position_m=_vector(position_m),
        orientation=pb.Quaternion(x=x, y=y, z=z, w=w),
    )
    return pb.Target(pose=pose, law=law)


def direction_target(direction: Vector, law: "pb.Law" = pb.DEFAULT) -> pb.Target:
    """Make a target: the tip pointing along a direction (3,) in the base frame."""
    wanted = pb.DirectionTarget(frame_id="base", direction=_vector(direction))
    return pb.Target(direction=wanted, law=law)


def point_target(position_m: Vector, station: float, law: "pb.Law" = pb.DEFAULT) -> pb.Target:
    """Make a target: the backbone's point at a station (0 to 1) at a position (3,), m."""
    point = pb.PointTarget(frame_id="base", position_m=_vector(position_m), station=station)
    return pb.Target(point=point, law=law)


def twist_target(
    linear_m_s: Vector,
    angular_rad_s: Vector | None,
    frame_id: str,
    reference_point: str,
    law: "pb.Law" = pb.DEFAULT,
) -> pb.Target:
    """Make a target: the tip moving with a twist."""
    twist = pb.TwistTarget(
        frame_id=frame_id,
        reference_point=reference_point,
        linear_m_s=_vector(linear_m_s),
        angular_rad_s=None if angular_rad_s is None else _vector(angular_rad_s),
    )
    return pb.Target(twist=twist, law=law)


def circle_target(
    center_m: Vector,
    radius_m: float,
    frequency_hz: float,
    turns: float = 0.0,
    normal: Vector = (0.0, 0.0, 1.0),
    shape_id: int = 0,
    law: "pb.Law" = pb.DEFAULT,
) -> pb.Target:
    """Make a target: the tip on a circle; 0 turns are without end, another id starts it anew."""
    circle = pb.CircleTarget(
        frame_id="base",
        id=shape_id,
        center_m=_vector(center_m),
        normal=_vector(normal),
        radius_m=radius_m,
        frequency_hz=frequency_hz,
        turns=turns,
    )
    return pb.Target(circle=circle, law=law)


def line_target(
    start_m: Vector,
    end_m: Vector,
    period_s: float,
    repeats: float = 0.0,
    shape_id: int = 0,
    law: "pb.Law" = pb.DEFAULT,
) -> pb.Target:
    """Make a target: the tip from one point to another and back in a period; 0: without end."""
    line = pb.LineTarget(
        frame_id="base",
        id=shape_id,
        start_m=_vector(start_m),
        end_m=_vector(end_m),
        period_s=period_s,
        repeats=repeats,
    )
    return pb.Target(line=line, law=law)


def trajectory_target(
    waypoints: Iterable[tuple[float, Vector]], shape_id: int = 0, law: "pb.Law" = pb.DEFAULT
) -> pb.Target:
    """Make a target: the tip through positions (3,) at their times, s after the first arrival."""
    points = [pb.Waypoint(time_s=time, position_m=_vector(point)) for time, point in waypoints]
    trajectory = pb.TrajectoryTarget(frame_id="base", id=shape_id, waypoints=points)
    return pb.Target(trajectory=trajectory, law=law)

"""Target messages made from plain numbers, SI units, for programs and for the command line."""

from collections.abc import Sequence

from logs.schema import pneuarm_pb2 as pb

Vector = Sequence[float]


def _vector(values: Vector) -> pb.Vector3:
    x, y, z = (float(value) for value in values)
    return pb.Vector3(x=x, y=y, z=z)


def position_target(position_m: Vector, law: "pb.Law" = pb.DEFAULT) -> pb.Target:
    """Make a target: the tip at a position (3,) in the base frame, m."""
    position = pb.PositionTarget(frame_id="base", position_m=_vector(position_m))
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

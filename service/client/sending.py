"""Every kind of target that a program can send, from plain numbers in SI units."""

from abc import ABC, abstractmethod
from collections.abc import Iterable

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.target_messages import (
    Vector,
    circle_target,
    direction_target,
    line_target,
    point_target,
    pose_target,
    position_target,
    trajectory_target,
    twist_target,
)


class Sending(ABC):
    """Sends targets, each once, and returns its sequence number.

    A target must be sent again before the daemon's target timeout (200 ms), or the arm holds.
    """

    @abstractmethod
    def send(self, target: pb.Target) -> int:
        """Send one target of any kind, once; return its sequence number."""

    def send_position(
        self,
        position_m: Vector,
        law: "pb.Law" = pb.DEFAULT,
        velocity_m_s: Vector | None = None,
    ) -> int:
        """Send a tip position (3,) in the base frame, m; in a stream also its velocity."""
        return self.send(position_target(position_m, law, velocity_m_s))

    def send_pose(
        self, position_m: Vector, quaternion_xyzw: Vector, law: "pb.Law" = pb.DEFAULT
    ) -> int:
        """Send a tip pose in the base frame: position (3,) m, unit quaternion (4,)."""
        return self.send(pose_target(position_m, quaternion_xyzw, law))

    def send_direction(self, direction: Vector, law: "pb.Law" = pb.DEFAULT) -> int:
        """Send the direction (3,) in the base frame along which the tip shall point."""
        return self.send(direction_target(direction, law))

    def send_point(self, position_m: Vector, station: float, law: "pb.Law" = pb.DEFAULT) -> int:
        """Send a position (3,) m for the backbone's point at a station, 0 (base) to 1 (tip)."""
        return self.send(point_target(position_m, station, law))

    def send_twist(
        self,
        linear_m_s: Vector,
        angular_rad_s: Vector | None = None,
        frame_id: str = "base",
        reference_point: str = "tip",
        law: "pb.Law" = pb.DEFAULT,
    ) -> int:
        """Send a tip twist: linear (3,) m/s, angular (3,) rad/s or None."""
        return self.send(twist_target(linear_m_s, angular_rad_s, frame_id, reference_point, law))

    def send_lengths(self, lengths_m: Vector) -> int:
        """Send chamber lengths, three a section, m."""
        return self.send(pb.Target(lengths=pb.LengthsTarget(length_m=lengths_m)))

    def send_pressures(self, pressures_pa: Vector) -> int:
        """Send chamber pressures, three a section, gauge, Pa."""
        return self.send(pb.Target(pressures=pb.PressuresTarget(pressure_pa=pressures_pa)))

    def send_circle(
        self,
        center_m: Vector,
        radius_m: float,
        frequency_hz: float,
        turns: float = 0.0,
        normal: Vector = (0.0, 0.0, 1.0),
        shape_id: int = 0,
    ) -> int:
        """Send a circle on the daemon's clock; 0 turns: without end; another id starts it anew."""
        return self.send(circle_target(center_m, radius_m, frequency_hz, turns, normal, shape_id))

    def send_line(
        self,
        start_m: Vector,
        end_m: Vector,
        period_s: float,
        repeats: float = 0.0,
        shape_id: int = 0,
    ) -> int:
        """Send a line there and back in a period on the daemon's clock; 0 repeats: without end."""
        return self.send(line_target(start_m, end_m, period_s, repeats, shape_id))

    def send_trajectory(self, waypoints: Iterable[tuple[float, Vector]], shape_id: int = 0) -> int:
        """Send positions (3,) m with their times, s after the first arrival."""
        return self.send(trajectory_target(waypoints, shape_id))

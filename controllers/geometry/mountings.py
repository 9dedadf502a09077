"""How motion capture, base, marker, tip and tool stand to each other, as rigid transforms.

A transform ``a_to_b`` takes coordinates in a to coordinates in b.
"""

from dataclasses import dataclass, field

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.geometry.rotations import rotation_from_vector


@dataclass(frozen=True)
class Transform:
    """A rigid motion: ``x -> rotation x + position``."""

    rotation: Array = field(default_factory=lambda: np.eye(3))
    position_m: Array = field(default_factory=lambda: np.zeros(3))

    def __matmul__(self, other: "Transform") -> "Transform":
        """First the other, then this."""
        return Transform(
            self.rotation @ other.rotation, self.rotation @ other.position_m + self.position_m
        )

    def inverse(self) -> "Transform":
        """Undo it."""
        back: Array = self.rotation.T
        return Transform(back, -(back @ self.position_m))


def transform_of(position_m: Array, rotation_vector_rad: Array) -> Transform:
    """Transform from a position and a rotation vector; raises InvalidInput beyond half a turn."""
    angle = float(np.linalg.norm(rotation_vector_rad))
    if angle > np.pi + 1e-9:
        raise InvalidInput(
            f"a rotation vector of {np.rad2deg(angle):.4g} degrees: at most 180 are allowed"
        )
    return Transform(rotation_from_vector(rotation_vector_rad), position_m)


@dataclass(frozen=True)
class Mountings:
    """Mountings of one arm: what a motion-capture system measures, and what targets name.

    ``mocap_to_base`` takes coordinates of the capture system to the base, ``tip_to_marker`` those
    of the tip to its marker; ``tool_m`` is the tool point in the tip frame.
    """

    mocap_frame: str = ""
    mocap_to_base: Transform = field(default_factory=Transform)
    tip_to_marker: Transform = field(default_factory=Transform)
    tool_m: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def tool_pose(self, marker: Transform, frame_id: str) -> Transform:
        """Pose of the tool point in the base, from the marker's pose in a frame.

        Raises InvalidInput for a frame that is neither the base nor the capture system's.
        """
        if frame_id == "base":
            in_base = marker
        elif frame_id and frame_id == self.mocap_frame:
            in_base = self.mocap_to_base @ marker
        else:
            known = f"'base', {self.mocap_frame!r}" if self.mocap_frame else "'base'"
            raise InvalidInput(f"frame_id = {frame_id!r}: unknown frame; allowed: {known}")
        tip = in_base @ self.tip_to_marker
        return tip @ Transform(position_m=np.array(self.tool_m))

    def marker_pose(self, tip: Transform) -> Transform:
        """Pose of the marker in the capture system, from the tip's (not the tool's) in the base."""
        return self.mocap_to_base.inverse() @ tip @ self.tip_to_marker.inverse()

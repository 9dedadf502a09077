"""Between the frame that measures and the arm: where its base stands, where on the tip the marker.

A measured position is ``world = R (tip + R_tip marker) + t``. The rotation starts from the rigid
motion that lays the model's tips over the measured ones (Kabsch), and is refined by a small turn.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.geometry.rotations import rotation_from_vector


@dataclass(frozen=True)
class Frames:
    """``rotation`` (3, 3) and ``translation_m`` (3,) from the base to the measuring frame.

    ``marker_m`` (3,) is the marker in the tip frame, ``axis`` (3,) where the tip points in the
    frame of the marker. How the marker sits turned about that axis is not asked for.
    """

    rotation: Array
    translation_m: Array
    marker_m: Array
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))

    def measured_m(self, pose: Array) -> Array:
        """Measured positions (batch, 3) of tips (batch, 12): positions, then rotations by rows."""
        turned = pose[:, 3:].reshape(-1, 3, 3) @ self.marker_m
        return (pose[:, :3] + turned) @ self.rotation.T + self.translation_m

    def over_pose(self) -> Array:
        """Derivative (3, 12) of a measured position over a tip's pose."""
        rows = [self.rotation, *(np.outer(self.rotation[:, k], self.marker_m) for k in range(3))]
        return np.concatenate(rows, axis=1)

    def over_frames(self, pose: Array) -> Array:
        """Derivative (batch, 3, 9) over a further small turn, the translation and the marker."""
        batch = len(pose)
        placed = self.measured_m(pose) - self.translation_m
        derivative = np.zeros((batch, 3, 9))
        for axis, unit in enumerate(np.eye(3)):
            derivative[:, :, axis] = np.cross(unit, placed)
        derivative[:, :, 3:6] = np.eye(3)
        derivative[:, :, 6:] = self.rotation @ pose[:, 3:].reshape(-1, 3, 3)
        return derivative

    def directions(self, pose: Array) -> Array:
        """Directions (batch, 3) in which tips (batch, 12) point, in the measuring frame."""
        return pose[:, [5, 8, 11]] @ self.rotation.T

    def directions_over_pose(self) -> Array:
        """Derivative (3, 12) of a direction over a tip's pose."""
        derivative = np.zeros((3, 12))
        derivative[:, [5, 8, 11]] = self.rotation
        return derivative

    def directions_over_frames(self, pose: Array) -> Array:
        """Derivative (batch, 3, 9) of the directions, as :meth:`over_frames`."""
        derivative = np.zeros((len(pose), 3, 9))
        directions = self.directions(pose)
        for axis, unit in enumerate(np.eye(3)):
            derivative[:, :, axis] = np.cross(unit, directions)
        return derivative

    def moved(self, change: Array) -> "Frames":
        """Frames after a small turn (3,), translation (3,) and marker (3,)."""
        return replace(
            self,
            rotation=rotation_from_vector(change[:3]) @ self.rotation,
            translation_m=self.translation_m + change[3:6],
            marker_m=self.marker_m + change[6:],
        )


def in_base() -> Frames:
    """Frames of a measurement of the tip itself in the base."""
    return Frames(np.eye(3), np.zeros(3), np.zeros(3))


def aligned(tips_m: Array, measured_m: Array) -> Frames:
    """Frames that lay tips (batch, 3) over measured positions (batch, 3) best, without marker."""
    tips, measured = tips_m.mean(axis=0), measured_m.mean(axis=0)
    left, _, right = np.linalg.svd((measured_m - measured).T @ (tips_m - tips))
    sign = np.array([1.0, 1.0, np.linalg.det(left @ right)])
    rotation = (left * sign) @ right
    return Frames(rotation, measured - rotation @ tips, np.zeros(3))

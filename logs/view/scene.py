"""The 3D scene of the live view: the arm, its target and its tip, in metres in the base frame.

What never changes of an entity, its radii and most colours, is sent once, as static.
"""

import numpy as np
import rerun as rr

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.view import colors as colors
from pneuarm.logs.view.geometry import ArmShape
from pneuarm.logs.view.trail import Trail

_CROSS = np.array([-1.0, 1.0])[:, None] * np.eye(3)[:, None]  # three lines (3, 2, 3)


class Scene:
    """The scene of one arm in one recording."""

    def __init__(self, arm: Arm, recording: rr.RecordingStream) -> None:
        self._arm = arm
        self._recording = recording
        self._shape = ArmShape(arm)
        self._colors = colors.LengthColors(arm)
        self._thickness_m = arm.sections[0].chamber_offset_m
        # Marks stay visible on a long thin arm.
        self._mark_m = max(self._thickness_m, arm.total_rest_length_m / 9.0)
        self._shown: set[str] = set()
        self._trail = Trail()

    def start(self) -> None:
        """Send the base plate with its axes, and what stays the same of all the rest."""
        unit_m, n = self._thickness_m, self._arm.n_sections
        self._style("scene/base", _base_plate(unit_m), rr.TransformAxes3D(2.5 * unit_m))
        self._style("scene/arm/chambers", rr.LineStrips3D.from_fields(radii=0.14 * unit_m))
        self._style(
            "scene/arm/skeleton",
            rr.LineStrips3D.from_fields(
                radii=[0.04 * unit_m] + [0.06 * unit_m] * n,
                colors=[colors.BACKBONE] + [colors.PLATE] * n,
            ),
            rr.Points3D.from_fields(radii=0.2 * unit_m, colors=colors.CHAMBERS * n),
        )
        self._style(
            "scene/trail",
            rr.LineStrips3D.from_fields(radii=0.02 * unit_m, colors=colors.TRAIL),
        )
        self._style_mark("scene/tip_true", colors.TIP_TRUE)
        self._style_mark("scene/tip_measured", colors.TIP_MEASURED)

    def _style_mark(self, path: str, color: colors.Color) -> None:
        self._style(path, rr.Points3D.from_fields(radii=0.16 * self._mark_m, colors=color))

    def _style(self, path: str, *parts: rr.AsComponents) -> None:
        self._recording.log(path, parts[0], *parts[1:], static=True)

    def show(self, ticks: np.ndarray) -> None:
        """Show the newest of the ticks, shape (n,); the trail takes all of them."""
        tick = ticks[-1]
        self._show_arm(tick["length_estimated_m"])
        self._show_target(tick)
        self._show_frame("scene/target/frame", tick, "target")
        self._show_frame("scene/tip", tick, "tip_estimated")
        self._show_tip("scene/tip_true", tick["tip_true_position_m"])
        self._show_tip("scene/tip_measured", tick["tip_measured_position_m"])
        self._trail.add(ticks)
        trail = rr.LineStrips3D.from_fields(strips=self._trail.positions_m()[None])
        self._recording.log("scene/trail", trail)

    def _show_arm(self, lengths_m: Array) -> None:
        if np.isnan(lengths_m).any():
            self._hide("scene/arm/chambers")
            self._hide("scene/arm/skeleton")
            return
        lines, by_length = self._shape.lines(lengths_m), self._colors.of(lengths_m)
        self._show(
            "scene/arm/chambers",
            rr.LineStrips3D.from_fields(strips=lines.chambers_m, colors=by_length),
        )
        self._show(
            "scene/arm/skeleton",
            rr.LineStrips3D.from_fields(strips=[lines.backbone_m, *lines.plates_m]),
            rr.Points3D.from_fields(positions=lines.chamber_ends_m),
        )

    def _show_target(self, tick: np.void) -> None:
        position_m = tick["target_position_m"]
        if np.isnan(position_m).any():
            self._hide("scene/target")
            return
        out = tick["reach"] == pb.OUT_OF_REACH
        color = colors.TARGET_OUT_OF_REACH if out else colors.TARGET
        # The cross sticks out of the tip's marks when the tip is there.
        cross = (position_m + 0.6 * self._mark_m * _CROSS).astype(np.float32)
        self._show(
            "scene/target",
            rr.LineStrips3D(cross, radii=0.03 * self._mark_m, colors=color),
            rr.Points3D(
                position_m,
                radii=0.16 * self._mark_m,
                colors=color,
                labels=["out of reach"] if out else [],  # the title explains the cross
            ),
        )

    def _show_tip(self, path: str, position_m: Array) -> None:
        if np.isnan(position_m).any():
            self._hide(path)
        else:
            self._show(path, rr.Points3D.from_fields(positions=position_m))

    def _show_frame(self, path: str, tick: np.void, name: str) -> None:
        position_m, xyzw = tick[f"{name}_position_m"], tick[f"{name}_orientation_xyzw"]
        if np.isnan(position_m).any() or np.isnan(xyzw).any():
            self._hide(path)
            return
        frame = rr.Transform3D(translation=position_m, quaternion=xyzw)
        # Not static: axes without a transform would stand at the base.
        self._show(path, frame, rr.TransformAxes3D(self._mark_m))

    def _show(self, path: str, *parts: rr.AsComponents) -> None:
        self._recording.log(path, parts[0], *parts[1:])
        self._shown.add(path)

    def _hide(self, path: str) -> None:
        # What has become unknown must not stay where it was last seen.
        if path in self._shown:
            self._recording.log(path, rr.Clear(recursive=False))
            self._shown.remove(path)


def _base_plate(thickness_m: float) -> rr.Cylinders3D:
    return rr.Cylinders3D(
        lengths=[0.1 * thickness_m],
        radii=[1.8 * thickness_m],
        centers=[[0.0, 0.0, -0.05 * thickness_m]],
        colors=[colors.PLATE],
        fill_mode="solid",
    )

"""Where motion capture, marker and tool are."""

import math
from typing import Annotated

import numpy as np
from pydantic import Field, field_validator

from pneuarm.controllers.geometry.mountings import Mountings, Transform, transform_of
from pneuarm.hardware.tables.table import MM, Finite, Table

Triple = Annotated[tuple[Finite, Finite, Finite], Field(strict=False)]


class FramesConfig(Table):
    """Poses of one frame in another: a position and a rotation vector, axis times angle."""

    mocap_frame: Annotated[
        str,
        Field(
            max_length=64,
            description=(
                "`frame_id` of poses in the frame of the motion-capture system; empty: only `base` "
                "is taken"
            ),
        ),
    ] = ""
    mocap_position_mm: Annotated[Triple, Field(description="its origin in the base frame")] = (
        0.0,
        0.0,
        0.0,
    )
    mocap_rotation_deg: Annotated[Triple, Field(description="its rotation in the base frame")] = (
        0.0,
        0.0,
        0.0,
    )
    tip_in_marker_position_mm: Annotated[
        Triple, Field(description="the tip in the frame of its marker")
    ] = (0.0, 0.0, 0.0)
    tip_in_marker_rotation_deg: Annotated[Triple, Field(description="its rotation there")] = (
        0.0,
        0.0,
        0.0,
    )
    tool_position_mm: Annotated[
        Triple,
        Field(
            description=(
                "the tool point in the tip frame; where it is not zero, all positions of the tip "
                "are those of this point"
            )
        ),
    ] = (0.0, 0.0, 0.0)

    @field_validator("mocap_rotation_deg", "tip_in_marker_rotation_deg")
    @classmethod
    def _at_most_half_a_turn(cls, value: Triple) -> Triple:
        if math.hypot(*value) > 180.0 + 1e-9:
            raise ValueError(
                f"a rotation vector of {math.hypot(*value):.4g} degrees; its length is the angle, "
                "at most 180"
            )
        return value

    def frames(self) -> Mountings:
        """Return the frames in SI units."""
        return Mountings(
            mocap_frame=self.mocap_frame,
            mocap_to_base=_transform(self.mocap_position_mm, self.mocap_rotation_deg),
            tip_to_marker=_transform(
                self.tip_in_marker_position_mm, self.tip_in_marker_rotation_deg
            ),
            tool_m=self.tool_m(),
        )

    def tool_m(self) -> tuple[float, float, float]:
        """Tool point in the tip frame, m."""
        x, y, z = self.tool_position_mm
        return (x * MM, y * MM, z * MM)


def _transform(position_mm: Triple, rotation_deg: Triple) -> Transform:
    return transform_of(MM * np.array(position_mm), np.deg2rad(rotation_deg))

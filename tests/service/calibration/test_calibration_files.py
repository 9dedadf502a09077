"""The frames that a calibration writes make of a measured marker the arm's tip."""

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.calibration.frames import Frames
from pneuarm.controllers.geometry.mountings import Transform
from pneuarm.controllers.geometry.rotations import rotation_from_vector
from pneuarm.service.calibration.files import MOCAP_FRAME, frames_table
from pneuarm.service.configuration.tables.frames import FramesConfig

TIP = Transform(rotation_from_vector(np.array([0.2, -0.4, 0.1])), np.array([0.03, -0.02, 0.19]))
WORLD = Transform(rotation_from_vector(np.array([0.3, -0.8, 1.9])), np.array([0.5, -0.2, 1.1]))
MARKER_M = np.array([0.0, 0.01, 0.02])
ROUGH = FramesConfig(
    mocap_frame="hall",
    mocap_position_mm=(100.0, 0.0, -300.0),
    mocap_rotation_deg=(0.0, 90.0, 0.0),
    tip_in_marker_position_mm=(0.0, 0.0, -5.0),
    tip_in_marker_rotation_deg=(0.0, 0.0, 90.0),
)


def received(before: FramesConfig, marker: Transform) -> Transform:
    """Tip that the daemon takes the marker for."""
    return before.frames().tool_pose(marker, before.mocap_frame or "base")


@pytest.mark.parametrize("before", [FramesConfig(), ROUGH])
def test_the_marker_that_was_measured_becomes_the_tip(before: FramesConfig) -> None:
    # What the fit sees, by its own definition: a point of the tip, in whatever it is measured in.
    found = Frames(WORLD.rotation, WORLD.position_m, MARKER_M)
    seen = WORLD @ TIP @ Transform(position_m=MARKER_M)
    known = before.frames()
    mocap = known.mocap_to_base if before.mocap_frame else Transform()
    marker = mocap.inverse() @ seen @ known.tip_to_marker.inverse()
    pose: Array = np.concatenate([TIP.position_m, TIP.rotation.reshape(-1)])[None]
    np.testing.assert_allclose(received(before, marker).position_m, found.measured_m(pose)[0])

    after = before.model_copy(update=frames_table(before, found))
    assert after.mocap_frame == (before.mocap_frame or MOCAP_FRAME)
    tip = received(after, marker)
    np.testing.assert_allclose(tip.position_m, TIP.position_m, atol=1e-6)
    np.testing.assert_allclose(tip.rotation, TIP.rotation, atol=1e-6)

"""Frames of a tick: what is known is there, what is not known is not."""

import numpy as np
import pytest

from pneuarm.logs.foxglove.frames import frame_transforms, timestamp, tip_pose
from pneuarm.logs.rings.tick import new_tick

TIME_NS = 1_800_000_000_123_456_789
QUATERNION = (0.5, -0.5, 0.5, 0.5)
PREFIXES = {
    "tip": "tip_estimated",
    "target": "target",
    "tip_true": "tip_true",
    "tip_measured": "tip_measured",
}


def a_tick() -> np.ndarray:
    tick = new_tick(1)
    tick["time_unix_ns"] = TIME_NS
    return tick


def place(tick: np.ndarray, prefix: str, x: float) -> None:
    tick[f"{prefix}_position_m"] = (x, x + 1, x + 2)
    tick[f"{prefix}_orientation_xyzw"] = QUATERNION


def test_the_tip_pose_is_the_estimated_one_in_the_base_frame() -> None:
    tick = a_tick()
    place(tick, "tip_estimated", 1.0)
    place(tick, "tip_true", 10.0)
    message = tip_pose(tick)
    position, orientation = message.pose.position, message.pose.orientation
    assert message.frame_id == "base"
    assert (position.x, position.y, position.z) == (1.0, 2.0, 3.0)
    assert (orientation.x, orientation.y, orientation.z, orientation.w) == QUATERNION
    assert message.timestamp.ToNanoseconds() == TIME_NS


def test_every_known_frame_stands_below_the_base() -> None:
    tick = a_tick()
    for number, prefix in enumerate(PREFIXES.values()):
        place(tick, prefix, 10.0 * number)
    transforms = frame_transforms(tick).transforms
    assert [transform.child_frame_id for transform in transforms] == list(PREFIXES)
    for number, transform in enumerate(transforms):
        translation, rotation = transform.translation, transform.rotation
        assert transform.parent_frame_id == "base"
        assert transform.timestamp.ToNanoseconds() == TIME_NS
        x = 10.0 * number
        assert (translation.x, translation.y, translation.z) == (x, x + 1, x + 2)
        assert (rotation.x, rotation.y, rotation.z, rotation.w) == QUATERNION


@pytest.mark.parametrize("frame", PREFIXES)
def test_a_frame_that_is_not_known_is_left_out(frame: str) -> None:
    tick = a_tick()
    for name, prefix in PREFIXES.items():
        if name != frame:
            place(tick, prefix, 0.0)
    found = {transform.child_frame_id for transform in frame_transforms(tick).transforms}
    assert found == set(PREFIXES) - {frame}


def test_a_position_without_orientation_is_a_frame_parallel_to_the_base() -> None:
    tick = a_tick()
    tick["target_position_m"] = (1.0, 2.0, 3.0)
    (transform,) = frame_transforms(tick).transforms
    rotation = transform.rotation
    assert (rotation.x, rotation.y, rotation.z, rotation.w) == (0.0, 0.0, 0.0, 1.0)


def test_an_unknown_tick_has_no_frames() -> None:
    assert len(frame_transforms(a_tick()).transforms) == 0


@pytest.mark.parametrize("time_ns", [0, 999_999_999, 1_000_000_000, TIME_NS])
def test_a_timestamp_keeps_every_nanosecond(time_ns: int) -> None:
    assert timestamp(time_ns).ToNanoseconds() == time_ns

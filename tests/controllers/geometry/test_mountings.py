"""Frames: from the marker in motion capture to the tool point in the base, and back."""

import numpy as np
import pytest

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.geometry.mountings import Mountings, Transform, transform_of
from pneuarm.controllers.geometry.rotations import rotation_from_vector, rotation_vector, spin_of
from pneuarm.controllers.kinematics.compiled import CompiledKinematics
from tools.rig.arms import paper_arm

RNG = np.random.default_rng(3)


def _random() -> Transform:
    return transform_of(RNG.normal(size=3), RNG.uniform(-1.5, 1.5, 3))


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.3, 2.0, np.pi])
def test_a_rotation_vector_gives_its_rotation(angle: float) -> None:
    vector = angle * np.array([0.6, 0.0, 0.8])
    rotation = rotation_from_vector(vector)
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.abs(rotation_vector(rotation)) == pytest.approx(np.abs(vector), abs=1e-7)


def test_more_than_half_a_turn_is_refused() -> None:
    with pytest.raises(InvalidInput, match="at most 180"):
        transform_of(np.zeros(3), np.array([0.0, 3.2, 0.0]))


def test_what_capture_sees_of_a_tip_comes_back_as_that_tip() -> None:
    frames = Mountings("hall", _random(), _random())
    tip = _random()
    back = frames.tool_pose(frames.marker_pose(tip), "hall")
    assert back.position_m == pytest.approx(tip.position_m)
    assert back.rotation == pytest.approx(tip.rotation)


def test_the_tool_point_lies_ahead_of_the_tip_and_other_frames_are_refused() -> None:
    tip = _random()
    frames = Mountings(tool_m=(0.0, 0.0, 0.1))
    tool = frames.tool_pose(tip, "base")
    assert tool.position_m == pytest.approx(tip.position_m + 0.1 * tip.rotation[:, 2])
    with pytest.raises(InvalidInput, match="'hall': unknown frame; allowed: 'base'"):
        frames.tool_pose(tip, "hall")
    with pytest.raises(InvalidInput, match="'': unknown frame"):
        frames.tool_pose(tip, "")


def test_the_kinematics_of_an_arm_with_a_tool_are_those_of_the_tool_point() -> None:
    from dataclasses import replace

    arm = paper_arm()
    tool = np.array([0.01, -0.02, 0.08])
    with_tool = CompiledKinematics(replace(arm, tool_m=tuple(tool)))
    lengths = arm.rest_lengths_m + np.array([[0.02, -0.01, 0.03]])
    plain, _ = CompiledKinematics(arm).fresh(lengths)
    transform, jacobian = with_tool.fresh(lengths)
    assert transform[:3, 3] == pytest.approx(plain[:3, 3] + plain[:3, :3] @ tool)
    for chamber in range(3):
        step = np.zeros((1, 3))
        step[0, chamber] = 1e-6
        after, _ = with_tool.fresh(lengths + step)
        before, _ = with_tool.fresh(lengths - step)
        numeric = (after[:3, 3] - before[:3, 3]) / 2e-6
        assert jacobian[:3, chamber] == pytest.approx(numeric, abs=1e-6)


def test_the_spin_of_a_rotation_vector_is_the_derivative_of_its_rotation() -> None:
    turn, rate = np.array([0.4, -0.9, 0.3]), np.array([0.2, 0.5, -1.0])
    step = 1e-6
    later, before = (rotation_from_vector(turn + d * rate) for d in (step, -step))
    numeric = rotation_vector(later @ before.T) / (2 * step)
    assert spin_of(turn, rate) == pytest.approx(numeric, abs=1e-6)
    assert spin_of(np.zeros(3), rate) == pytest.approx(rate)

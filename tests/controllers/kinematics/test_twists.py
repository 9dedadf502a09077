"""A twist target moves the tip as it says: frame, reference point, linear and angular part."""

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.controller import Controller
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.targets.targets import TwistTarget
from tests.controllers.laws.driving import DT_S, starting_at
from tools.rig.arms import ARMS, random_lengths, trunk_arm


def tip_twist_over_one_tick(arm: Arm, before: Array, after: Array) -> tuple[Array, Array]:
    first, second = tip_transform(arm, before), tip_transform(arm, after)
    spin = (second[:3, :3] - first[:3, :3]) @ first[:3, :3].T / DT_S
    return (second[:3, 3] - first[:3, 3]) / DT_S, np.array([spin[2, 1], spin[0, 2], spin[1, 0]])


def at_speed(controller: Controller) -> Array:
    """Go on until the acceleration is over; the lengths before the last tick."""
    for _ in range(20):
        before = controller.lengths_m
        controller.step(DT_S)
    return before


@pytest.mark.parametrize("in_tip_frame", [False, True], ids=["base", "tip"])
def test_a_linear_twist_moves_the_tip_as_asked(in_tip_frame: bool) -> None:
    for arm in ARMS.values():
        start = random_lengths(arm, np.random.default_rng(12), share=0.6)
        controller = starting_at(arm, start)
        wanted = np.array([0.006, -0.008, 0.004])
        controller.set_target(TwistTarget(wanted, None, in_tip_frame, False))
        start = at_speed(controller)
        linear, _ = tip_twist_over_one_tick(arm, start, controller.lengths_m)
        frame = tip_transform(arm, start)[:3, :3] if in_tip_frame else np.eye(3)
        np.testing.assert_allclose(linear, frame @ wanted, atol=2e-4)
        assert controller.reach == Reach.MOVING


@pytest.mark.parametrize("about_base_origin", [False, True], ids=["tip", "base"])
@pytest.mark.parametrize("in_tip_frame", [False, True], ids=["base-frame", "tip-frame"])
def test_a_full_twist_moves_the_trunk_as_asked(in_tip_frame: bool, about_base_origin: bool) -> None:
    arm = trunk_arm()
    start = random_lengths(arm, np.random.default_rng(13), share=0.6)
    linear, angular = np.array([0.01, -0.006, 0.004]), np.array([0.03, 0.05, -0.02])
    controller = starting_at(arm, start)
    controller.set_target(TwistTarget(linear, angular, in_tip_frame, about_base_origin))
    start = at_speed(controller)
    transform = tip_transform(arm, start)
    frame = transform[:3, :3] if in_tip_frame else np.eye(3)
    expected = frame @ linear
    if about_base_origin:
        expected = expected + np.cross(frame @ angular, transform[:3, 3])
    moved, turned = tip_twist_over_one_tick(arm, start, controller.lengths_m)
    np.testing.assert_allclose(moved, expected, atol=5e-4)
    np.testing.assert_allclose(turned, frame @ angular, atol=5e-3)


def test_with_three_degrees_of_freedom_the_linear_part_comes_first() -> None:
    arm = ARMS["paper"]
    linear = np.array([0.01, -0.006, 0.004])
    alone, both = (starting_at(arm, arm.rest_lengths_m) for _ in range(2))
    alone.set_target(TwistTarget(linear, None, False, False))
    both.set_target(TwistTarget(linear, np.array([0.5, 0.5, 0.5]), False, False))
    for _ in range(50):
        alone.step(DT_S)
        both.step(DT_S)
    np.testing.assert_array_equal(alone.lengths_m, both.lengths_m)

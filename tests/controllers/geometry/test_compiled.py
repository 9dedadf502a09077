"""The compiled kinematics against the numpy form and against finite differences."""

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.compiled import CompiledKinematics
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from tools.rig.arms import ARMS, random_lengths, table1_arm, trunk_arm

STEP_M = 1e-6


def configurations(arm: Arm) -> list[np.ndarray]:
    """Straight, almost straight, around the switch between the two formulas, and random."""
    rng = np.random.default_rng(3)
    straight = arm.rest_lengths_m
    nearly = [straight + size * rng.standard_normal(straight.shape) for size in (1e-15, 1e-9, 1e-6)]
    # theta^2 = 0.5 is where the series hands over to the closed form.
    switch = []
    for theta in np.sqrt(0.5) + np.array([-1e-9, 0.0, 1e-9]):
        bent = straight.copy()
        bent[:, 0] -= 1.5 * arm.per_section("chamber_offset_m")[:, 0] * theta
        switch.append(bent)
    return [straight, *nearly, *switch, *(random_lengths(arm, rng) for _ in range(30))]


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_the_compiled_pose_is_the_numpy_pose(arm: Arm) -> None:
    kinematics = CompiledKinematics(arm)
    for lengths in configurations(arm):
        tip = kinematics.evaluate(lengths)
        expected = tip_transform(arm, lengths)
        np.testing.assert_allclose(tip.position_m, expected[:3, 3], atol=1e-14)
        np.testing.assert_allclose(tip.rotation, expected[:3, :3], atol=1e-13)


def numerical_jacobian(arm: Arm, lengths: np.ndarray) -> np.ndarray:
    here = tip_transform(arm, lengths)[:3, :3]
    columns = []
    for offset in STEP_M * np.eye(arm.n_chambers):
        offset = offset.reshape(lengths.shape)
        rate = (tip_transform(arm, lengths + offset) - tip_transform(arm, lengths - offset)) / (
            2.0 * STEP_M
        )
        spin = rate[:3, :3] @ here.T
        columns.append([*rate[:3, 3], spin[2, 1], spin[0, 2], spin[1, 0]])
    return np.array(columns).T


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_the_jacobian_is_the_derivative_everywhere_also_at_the_straight_arm(arm: Arm) -> None:
    kinematics = CompiledKinematics(arm)
    for lengths in configurations(arm):
        jacobian = kinematics.evaluate(lengths).jacobian
        np.testing.assert_allclose(jacobian, numerical_jacobian(arm, lengths), atol=1e-7)


def test_the_state_is_a_view_that_the_next_evaluation_overwrites() -> None:
    arm = table1_arm()
    kinematics = CompiledKinematics(arm)
    first = kinematics.evaluate(arm.rest_lengths_m)
    before = first.position_m.copy()
    second = kinematics.evaluate(arm.rest_lengths_m + 0.01)
    assert second is first
    np.testing.assert_allclose(first.position_m - before, [0.0, 0.0, 0.01], atol=1e-15)


def test_two_arms_do_not_share_their_buffers() -> None:
    one, two = CompiledKinematics(table1_arm()), CompiledKinematics(trunk_arm())
    tip = one.evaluate(table1_arm().rest_lengths_m)
    before = tip.position_m.copy()
    two.evaluate(trunk_arm().rest_lengths_m)
    np.testing.assert_array_equal(tip.position_m, before)


def test_the_lengths_given_are_not_changed() -> None:
    lengths = random_lengths(trunk_arm(), np.random.default_rng(4))
    before = lengths.copy()
    CompiledKinematics(trunk_arm()).evaluate(lengths)
    np.testing.assert_array_equal(lengths, before)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_fresh_results_are_the_callers_own(arm: Arm) -> None:
    kinematics = CompiledKinematics(arm)
    first, second = configurations(arm)[-2:]
    kept = kinematics.fresh(first)
    before = [array.copy() for array in kept]
    transform, jacobian = kinematics.fresh(second)
    for array, same in zip(kept, before, strict=True):
        np.testing.assert_array_equal(array, same)
    tip = kinematics.evaluate(second)
    np.testing.assert_allclose(transform, tip_transform(arm, second), atol=1e-13)
    np.testing.assert_array_equal(transform[:3, 3], tip.position_m)
    np.testing.assert_array_equal(transform[:3, :3], tip.rotation)
    np.testing.assert_array_equal(jacobian, tip.jacobian)
    assert not np.shares_memory(jacobian, tip.jacobian)
    assert not np.shares_memory(transform, tip.rotation)


def test_lengths_of_another_arm_are_refused() -> None:
    kinematics = CompiledKinematics(trunk_arm())
    for evaluate in (kinematics.evaluate, kinematics.fresh):
        with pytest.raises(InvalidInput, match=r"lengths_m has the shape \(1, 3\): \(3, 3\)"):
            evaluate(table1_arm().rest_lengths_m)

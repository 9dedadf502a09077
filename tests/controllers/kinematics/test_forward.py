"""Batches: every block and every layout gives what one configuration alone gives."""

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics import forward
from pneuarm.controllers.kinematics.constant_curvature import (
    section_end_transforms,
    section_transforms,
    tip_transform,
)
from tools.rig.arms import ARMS, paper_arm, trunk_arm


def batch(arm: Arm, *shape: int) -> np.ndarray:
    low, high = arm.per_chamber("length_min_m"), arm.per_chamber("length_max_m")
    share = np.random.default_rng(7).uniform(0.01, 0.99, (*shape, arm.n_sections, 3))
    return low + share * (high - low)


@pytest.mark.parametrize("number", [0, 1, 2, 7, 8, 9, 23])
@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_blocks_leave_no_seam(arm: Arm, number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forward, "BLOCK", 8)
    lengths = batch(arm, number)
    together = section_end_transforms(arm, lengths)
    assert together.shape == (number, arm.n_sections, 4, 4)
    for index in range(number):
        np.testing.assert_array_equal(together[index], section_end_transforms(arm, lengths[index]))


def test_a_large_batch_of_sections_is_each_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forward, "BLOCK", 8)
    shapes = np.random.default_rng(8).uniform(-2.0, 2.0, (3, 7, 3))
    together = section_transforms(shapes)
    for index in np.ndindex(3, 7):
        np.testing.assert_array_equal(together[index], section_transforms(shapes[index]))


def test_memory_that_is_not_in_order_is_read_right() -> None:
    arm = trunk_arm()
    lengths = batch(arm, 12)
    expected = tip_transform(arm, lengths)
    backwards = np.asfortranarray(lengths)[::-1]
    np.testing.assert_array_equal(tip_transform(arm, backwards), expected[::-1])


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_the_result_goes_where_it_is_told(arm: Arm) -> None:
    lengths = batch(arm, 4, 5)
    out = np.full((4, 5, 4, 4), np.nan)
    result = tip_transform(arm, lengths, out)
    assert np.shares_memory(result, out)
    np.testing.assert_array_equal(out, tip_transform(arm, lengths))


@pytest.mark.parametrize(
    "out",
    [np.empty((5, 4, 4)), np.empty((4, 4, 4), dtype=np.float32), np.empty((8, 4, 4))[::2]],
    ids=["shape", "type", "order"],
)
def test_a_place_that_cannot_take_the_result_is_refused(out: np.ndarray) -> None:
    with pytest.raises(InvalidInput, match=r"out has the shape"):
        tip_transform(paper_arm(), batch(paper_arm(), 4), out)


def test_bends_beyond_a_turn_take_the_closed_form() -> None:
    shapes = np.array([[0.2, 0.3, 0.1], [0.2, 6.0, 5.0]])
    theta = np.hypot(6.0, 5.0)
    tip = section_transforms(shapes)[1, :3, 3]
    radius = 0.2 / theta
    expected = radius * np.array(
        [(1 - np.cos(theta)) * 6.0 / theta, (1 - np.cos(theta)) * 5.0 / theta, np.sin(theta)]
    )
    np.testing.assert_allclose(tip, expected, atol=1e-15)


def test_a_length_outside_is_found_in_any_block(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forward, "BLOCK", 8)
    arm = trunk_arm()
    for value in (0.5, np.nan, arm.sections[1].length_max_m):
        lengths = batch(arm, 3, 11)
        lengths[2, 7, 1, 0] = value
        with pytest.raises(InvalidInput, match=r"lengths_m\[2, 7, 1, 0\] = .*section 1"):
            tip_transform(arm, lengths)

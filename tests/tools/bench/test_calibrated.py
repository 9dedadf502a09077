"""The measure of the calibration runs, and its claim holds for an arm of the family."""

import pytest

from tools.bench import calibrated


@pytest.mark.slow
@pytest.mark.parametrize("world", ["simulator", "mujoco"])
def test_a_calibrated_arm_is_three_times_nearer_and_within_three_percent(world: str) -> None:
    row = calibrated.measure("paper", 4, number=4, world=world)
    assert row["times_smaller"] > 3.0
    assert row["after_percent"]["mean"] < 3.0

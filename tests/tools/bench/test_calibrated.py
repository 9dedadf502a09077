"""The measure of the calibration runs, and its claim holds for an arm of the family."""

import pytest

from tools.bench import calibrated


@pytest.mark.slow
@pytest.mark.parametrize(("preset", "seed"), [("paper", 4)])
def test_a_calibrated_arm_is_three_times_nearer_and_within_three_percent(
    preset: str, seed: int
) -> None:
    row = calibrated.measure(preset, seed, number=4)
    assert row["times_smaller"] > 3.0
    assert row["after_percent"]["mean"] < 3.0

"""The frozen geometry: shapes, read-only arrays and what is refused."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import CHAMBER_ANGLES_RAD, Arm
from pneuarm.controllers.arm.errors import InvalidInput, PneuarmError
from tools.rig.arms import ARMS, PAPER_SECTION, paper_arm, trunk_arm


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_chamber_arrays_have_a_row_a_section_and_three_columns(arm: Arm) -> None:
    values = arm.per_chamber("length_max_m")
    assert values.shape == (arm.n_sections, 3)
    assert values.size == arm.n_chambers
    for row, section in zip(values, arm.sections, strict=True):
        assert row.tolist() == 3 * [section.length_max_m]


def test_section_arrays_have_one_column() -> None:
    assert trunk_arm().per_section("rest_length_m").tolist() == [[0.15], [0.12], [0.1]]


def test_the_arm_is_as_long_as_its_sections_together() -> None:
    assert trunk_arm().total_rest_length_m == pytest.approx(0.37)
    assert trunk_arm().max_length_m == pytest.approx(1.5 * 0.37)


@pytest.mark.parametrize(
    "array",
    [paper_arm().rest_lengths_m, paper_arm().per_section("rest_length_m"), CHAMBER_ANGLES_RAD],
)
def test_shared_arrays_cannot_be_written(array: np.ndarray) -> None:
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 0.0


def test_geometry_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        PAPER_SECTION.rest_length_m = 0.3  # type: ignore[misc]


@pytest.mark.parametrize(
    ("field", "value", "other"),
    [
        ("length_min_m", 0.2, "rest_length_m"),
        ("length_max_m", 0.2, "rest_length_m"),
        ("rest_length_m", 0.31, "length_max_m"),
        ("pressure_min_pa", 0.9e5, "pressure_max_pa"),
        ("length_min_m", np.nan, "rest_length_m"),
    ],
)
def test_bounds_that_contradict_each_other_are_refused_by_name_and_value(
    field: str, value: float, other: str
) -> None:
    with pytest.raises(InvalidInput) as refusal:
        replace(PAPER_SECTION, **{field: value})
    assert field in str(refusal.value)
    assert f"{value:g}" in str(refusal.value)
    assert other in str(refusal.value)


@pytest.mark.parametrize(
    "bounds",
    [
        {"pressure_min_pa": 1.0, "pressure_max_pa": 2.0},
        {"pressure_min_pa": -2.0, "pressure_max_pa": -1.0},
    ],
)
def test_a_pressure_range_without_ambient_is_refused(bounds: dict[str, float]) -> None:
    with pytest.raises(InvalidInput, match="zero"):
        replace(PAPER_SECTION, **bounds)


def test_a_range_that_begins_at_ambient_is_taken() -> None:
    assert replace(PAPER_SECTION, pressure_min_pa=0.0).pressure_min_pa == 0.0


def test_an_arm_without_sections_is_refused_by_its_name() -> None:
    with pytest.raises(InvalidInput, match="'empty'"):
        Arm("empty", ())


def test_a_refusal_is_both_ours_and_a_value_error() -> None:
    assert issubclass(InvalidInput, PneuarmError)
    assert issubclass(InvalidInput, ValueError)

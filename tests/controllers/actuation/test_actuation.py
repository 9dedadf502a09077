"""The pressure map: exact inverse, table 1, and the bounds that follow from it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.actuation.pressure_map import (
    PressureMap,
    length_bounds_m,
    pressure_length_bounds_m,
)
from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.kinematics.constant_curvature import section_inverse, tip_transform
from tools.rig.arms import ARMS, PAPER_SECTION, TABLE1_SECTION, paper_arm, table1_arm

#: Table 1 of the paper: pressure (bar), then y and z of constant curvature (mm).
TABLE_1 = np.array([[0.4, 23.2, 179.4], [0.6, 37.2, 182.2], [0.8, 53.9, 183.0]])
BAR_PA = 1e5


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@given(share=st.floats(0.0, 1.0))
def test_pressures_come_back_from_their_lengths(arm: Arm, share: float) -> None:
    low, high = arm.per_chamber("pressure_min_pa"), arm.per_chamber("pressure_max_pa")
    pressures = low + share * (high - low)
    pressure_map = PressureMap(arm)
    back = pressure_map.pressures_pa(pressure_map.lengths_m(pressures))
    np.testing.assert_allclose(back, pressures, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@given(share=st.floats(0.0, 1.0))
def test_lengths_come_back_from_their_pressures(arm: Arm, share: float) -> None:
    low, high = length_bounds_m(arm)
    lengths = low + share * (high - low)
    pressure_map = PressureMap(arm)
    back = pressure_map.lengths_m(pressure_map.pressures_pa(lengths))
    np.testing.assert_allclose(back, lengths, rtol=0.0, atol=1e-15)


def test_a_vented_chamber_has_its_rest_length_and_back() -> None:
    arm = paper_arm()
    pressure_map = PressureMap(arm)
    np.testing.assert_array_equal(pressure_map.lengths_m(np.zeros((1, 3))), arm.rest_lengths_m)
    np.testing.assert_array_equal(pressure_map.pressures_pa(arm.rest_lengths_m), np.zeros((1, 3)))


@given(st.floats(-0.9e5, 0.9e5), st.floats(0.1, 1e4))
def test_more_pressure_always_means_a_longer_chamber(pressure: float, more: float) -> None:
    lengths_m = PressureMap(paper_arm()).lengths_m
    assert (
        lengths_m(np.full((1, 3), pressure + more)) > lengths_m(np.full((1, 3), pressure))
    ).all()


@given(st.floats(0.0, 0.9e5))
def test_vacuum_shortens_as_much_as_pressure_lengthens(pressure: float) -> None:
    arm = paper_arm()
    lengths_m = PressureMap(arm).lengths_m
    longer = lengths_m(np.full((1, 3), pressure)) - arm.rest_lengths_m
    shorter = arm.rest_lengths_m - lengths_m(np.full((1, 3), -pressure))
    np.testing.assert_allclose(longer, shorter, atol=1e-15)


def test_a_chamber_without_softening_lengthens_in_proportion() -> None:
    arm = Arm("linear", (replace(PAPER_SECTION, softening_m_per_pa2=0.0),))
    pressures = np.array([[-0.9e5, 0.3e5, 0.9e5]])
    lengths = PressureMap(arm).lengths_m(pressures)
    np.testing.assert_allclose(lengths, 0.2 + 1e-6 * pressures)
    np.testing.assert_allclose(PressureMap(arm).pressures_pa(lengths), pressures)


def test_a_batch_is_mapped_element_by_element() -> None:
    arm = paper_arm()
    batch = np.linspace(-0.9e5, 0.9e5, 12).reshape(4, 1, 3)
    lengths = PressureMap(arm).lengths_m(batch)
    assert lengths.shape == (4, 1, 3)
    np.testing.assert_array_equal(lengths[2], PressureMap(arm).lengths_m(batch[2]))


def fitted_table1_arm() -> Arm:
    """Fit the two coefficients to the lengthening that table 1's positions imply."""
    rows = TABLE_1
    theta = 2.0 * np.arctan2(rows[:, 1], rows[:, 2])
    lengthening_m = 1.5 * theta * TABLE1_SECTION.chamber_offset_m
    pressures = rows[:, 0] * BAR_PA
    linear, quadratic = np.linalg.lstsq(
        np.column_stack([pressures, pressures**2]), lengthening_m, rcond=None
    )[0]
    section = replace(
        TABLE1_SECTION, lengthening_m_per_pa=float(linear), softening_m_per_pa2=float(quadratic)
    )
    return Arm("table1", (section,))


@pytest.mark.parametrize(("bar", "mm_per_bar"), [(0.4, 36.7), (0.6, 38.3), (0.8, 40.8)])
def test_two_coefficients_give_the_lengthening_of_table_1(bar: float, mm_per_bar: float) -> None:
    arm = fitted_table1_arm()
    lengths = PressureMap(arm).lengths_m(np.full((1, 3), bar * BAR_PA))
    lengthening_mm = 1e3 * (lengths - arm.rest_lengths_m)[0, 0]
    assert lengthening_mm / bar == pytest.approx(mm_per_bar, abs=0.35)


@pytest.mark.parametrize("arm", [fitted_table1_arm(), table1_arm()], ids=["fitted", "table1"])
@pytest.mark.parametrize("row", TABLE_1, ids=["0.4bar", "0.6bar", "0.8bar"])
def test_the_positions_of_table_1_come_out_within_a_quarter_millimetre(
    arm: Arm, row: np.ndarray
) -> None:
    # Chambers 1 and 2 filled bend the arm away from them, toward the third at 240 degrees.
    pressures = np.array([[row[0], row[0], 0.0]]) * BAR_PA
    x, y, z = tip_transform(arm, PressureMap(arm).lengths_m(pressures))[:3, 3]
    assert 1e3 * np.hypot(x, y) == pytest.approx(row[1], abs=0.25)
    assert 1e3 * z == pytest.approx(row[2], abs=0.25)
    assert np.rad2deg(np.arctan2(y, x)) % 360.0 == pytest.approx(240.0)


def test_table_1_itself_gives_the_rest_length_and_offset_of_the_arm() -> None:
    shapes = section_inverse(np.column_stack([TABLE_1[:, 1], np.zeros(3), TABLE_1[:, 2]]) * 1e-3)
    offset, rest = np.polyfit(shapes[:, 1], shapes[:, 0], 1)
    assert offset == pytest.approx(TABLE1_SECTION.chamber_offset_m, abs=2e-5)
    assert rest == pytest.approx(TABLE1_SECTION.rest_length_m, abs=2e-5)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_the_bounds_lie_strictly_inside_eq_4_and_inside_the_pressure_range(arm: Arm) -> None:
    low, high = length_bounds_m(arm)
    assert low.shape == high.shape == (arm.n_sections, 3)
    assert (low > arm.per_chamber("length_min_m")).all()
    assert (high < arm.per_chamber("length_max_m")).all()
    pressure_low, pressure_high = pressure_length_bounds_m(arm)
    assert (low >= pressure_low).all()
    assert (high <= pressure_high).all()


def test_the_paper_arm_is_bound_by_eq_4_and_the_table_1_arm_by_its_pressure() -> None:
    low, high = length_bounds_m(paper_arm())
    np.testing.assert_allclose(low, 0.1, atol=2e-6)
    np.testing.assert_allclose(high, 0.3, atol=2e-6)
    low, high = length_bounds_m(table1_arm())
    np.testing.assert_array_equal(low, table1_arm().rest_lengths_m)
    assert (high < TABLE1_SECTION.length_max_m - 0.01).all()

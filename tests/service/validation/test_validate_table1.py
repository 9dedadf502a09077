"""Table 1: the identified arm, its two computed columns, its percentages, and gravity."""

from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError, InvalidInput
from pneuarm.controllers.kinematics.models.cosserat_rod import CosseratRod, RodProperties
from pneuarm.service.validation.gravity import cross_validate, fit_rows, hanging_tip
from pneuarm.service.validation.table1 import BAR, COLUMNS, PrintedTable, identify, read_table

SHARED = (
    "pressure_bar,y_measured_mm,z_measured_mm,y_cc_mm,z_cc_mm,error_y_percent,error_z_percent\n"
    "0.4,20.9,178.2,23.2,179.4,9,0.6\n"
    "0.6,33.6,179.9,37.2,182.2,9.6,1.2\n"
    "0.8,47,184,53.9,183,12.8,0.5\n"
)


def computed_mm(table: PrintedTable) -> np.ndarray:
    return 1e3 * identify(table).tip_m(table.column("pressure_bar", BAR))


def printed_mm(table: PrintedTable) -> np.ndarray:
    return np.stack([table.column("y_cc_mm"), table.column("z_cc_mm")], axis=-1)


def test_the_packaged_table_is_the_papers(tmp_path: Path) -> None:
    path = tmp_path / "table1.csv"
    path.write_text(SHARED)
    assert read_table() == read_table(path)


def test_the_arm_comes_out_as_the_documentation_says() -> None:
    arm = identify(read_table())
    assert 1e3 * arm.rest_length_m == pytest.approx(171.72, abs=0.005)
    assert 1e3 * arm.chamber_offset_m == pytest.approx(38.01, abs=0.005)


def test_the_six_constant_curvature_values_follow_from_the_pressures() -> None:
    table = read_table()
    np.testing.assert_allclose(computed_mm(table), printed_mm(table), rtol=0.0, atol=0.3)


def test_the_percentages_that_follow_are_within_a_point_of_the_tables() -> None:
    table = read_table()
    for column, axis in enumerate("yz"):
        computed = computed_mm(table)[:, column]
        error = 100.0 * abs(table.column(f"{axis}_measured_mm") / computed - 1.0)
        np.testing.assert_allclose(error, table.column(f"error_{axis}_percent"), atol=1.0)


@pytest.mark.parametrize("axis", ["y", "z"])
def test_from_the_tables_own_millimetres_its_percentages_follow_exactly(axis: str) -> None:
    table = read_table()
    cut = table.cut_errors_percent(axis)
    assert cut == table.printed[f"error_{axis}_percent"]
    assert [str(value) for value in cut] == [
        str(value) for value in table.printed[f"error_{axis}_percent"]
    ]


def test_percentages_are_cut_not_rounded() -> None:
    printed = dict(read_table().printed)
    printed["error_y_percent"] = (Decimal("1.00"), Decimal("1.000"), Decimal("1"))
    assert [str(value) for value in PrintedTable(printed).cut_errors_percent("y")] == [
        "9.91",  # 9.9138
        "9.677",  # 9.6774
        "12",  # 12.80
    ]


def test_gravity_predicts_the_row_it_was_not_fitted_on() -> None:
    table = read_table()
    crossed = cross_validate(table)
    errors = np.abs(crossed.errors_percent(table))
    assert crossed.fits[2] == fit_rows(table, identify(table), [0, 1])
    assert errors[:, 0].max() < 3.0
    assert errors[:, 1].max() < 1.1


def test_the_fit_on_two_rows_does_not_see_the_third() -> None:
    table = read_table()
    spoilt = dict(table.printed)
    spoilt["y_measured_mm"] = (Decimal("20.9"), Decimal("33.6"), Decimal("99"))
    spoilt["z_measured_mm"] = (Decimal("178.2"), Decimal("179.9"), Decimal("9"))
    arm = identify(table)
    assert identify(PrintedTable(spoilt)) == arm
    assert fit_rows(PrintedTable(spoilt), arm, [0, 1]) == fit_rows(table, arm, [0, 1])


def test_without_weight_the_elastica_is_an_arc() -> None:
    theta, length = 0.9, 0.18
    arc = length / theta * np.array([1.0 - np.cos(theta), np.sin(theta)])
    np.testing.assert_allclose(hanging_tip(length, theta, 0.0), arc, atol=1e-10)


@pytest.mark.parametrize("weight_over_bending", [10.0, 31.0, -20.0])
def test_the_elastica_is_the_rod_that_does_not_stretch(weight_over_bending: float) -> None:
    length, theta = 0.18, 0.6
    section = replace(
        identify(read_table()).arm().sections[0], rest_length_m=length, chamber_offset_m=0.038
    )
    gravity = (0.0, 0.0, 9.81 * np.sign(weight_over_bending))
    rod = RodProperties(1.0, 1e12, abs(weight_over_bending) / length / 9.81)
    lengths = length - 0.038 * theta * np.array([[1.0, -0.5, -0.5]])
    tip = CosseratRod(rod).tip_transform(Arm("rod", (section,), gravity), lengths)
    expected = tip[[0, 2], 3]
    np.testing.assert_allclose(hanging_tip(length, theta, weight_over_bending), expected, atol=1e-8)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((0.0, 0.5, 1.0), "length_m = 0"),
        ((np.nan, 0.5, 1.0), "length_m = nan"),
        ((0.2, 7.0, 1.0), "theta_rad = 7"),
        ((0.2, 0.5, np.inf), "weight_over_bending_per_m2 = inf"),
    ],
)
def test_an_elastica_that_cannot_be_is_refused(arguments: tuple[float, ...], text: str) -> None:
    with pytest.raises(InvalidInput, match=text):
        hanging_tip(*arguments)


@pytest.mark.parametrize("rows", [[], [3], [-1, 0]])
def test_a_fit_on_rows_that_are_not_there_is_refused(rows: list[int]) -> None:
    table = read_table()
    with pytest.raises(InvalidInput, match=r"rows = .*0 to 2"):
        fit_rows(table, identify(table), rows)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", ".*".join(COLUMNS)),
        (SHARED.replace("y_cc_mm", "y"), "z_measured_mm, y,.*y_cc_mm"),
        ("\n".join(SHARED.splitlines()[:3]), "2 rows.*3"),
        (SHARED.replace("33.6", "x"), r"row 2, y_measured_mm = 'x'.*above 0"),
        (SHARED.replace("33.6", "nan"), r"row 2, y_measured_mm = 'nan'"),
        (SHARED.replace("33.6", "-33.6"), r"row 2, y_measured_mm = '-33.6'"),
        (SHARED.replace(",12.8,0.5", ""), r"row 3, error_y_percent = None"),
        (SHARED.replace("12.8,0.5", "12.8,0.5,7"), "row 3.*7 columns"),
    ],
)
def test_a_wrong_table_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "wrong.csv"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=message) as refusal:
        read_table(path)
    assert str(path) in str(refusal.value)


def test_a_table_that_is_not_there_or_no_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"none\.csv"):
        read_table(tmp_path / "none.csv")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigurationError, match=r"binary\.csv"):
        read_table(tmp_path / "binary.csv")


def test_the_columns_are_the_papers() -> None:
    assert SHARED.splitlines()[0] == ",".join(COLUMNS)

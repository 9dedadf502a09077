"""`pneuarm validate table1`: one object for programs, one table for people."""

import json
from pathlib import Path

import pytest

from pneuarm.service.cli.parser import main


def test_the_json_holds_every_row_and_the_parameters(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "table1", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [row["pressure_bar"] for row in report["rows"]] == [0.4, 0.6, 0.8]
    wanted = {"y_cc_mm", "z_cc_mm", "error_y_percent", "error_z_percent"}
    for row in report["rows"]:
        assert row.keys() >= wanted | {"y_gravity_mm", "z_gravity_mm"}
        assert abs(row["y_measured_mm"] / row["y_gravity_mm"] - 1.0) < 0.03
        assert abs(row["z_measured_mm"] / row["z_gravity_mm"] - 1.0) < 0.011
        assert row["error_y_percent_from_table_mm"] == row["error_y_percent_printed"]
        assert row["error_z_percent_from_table_mm"] == row["error_z_percent_printed"]
    assert report["parameters"]["rest_length_mm"] == pytest.approx(171.72, abs=0.01)


def test_the_table_for_people_has_a_line_a_row(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "table1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].split()[:4] == ["0.4", "20.9", "/", "178.2"]
    assert len({len(line) for line in lines[1:5]}) == 1  # aligned
    assert "171.72 mm" in lines[5]  # the rest length
    assert "38.01 mm" in lines[5]  # the offset


def test_a_table_file_that_is_not_there_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(tmp_path / "no.csv")
    assert main(["validate", "table1", "--table", path]) == 1
    assert path in capsys.readouterr().err

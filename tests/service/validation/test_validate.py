"""`pneuarm validate`, the comparison of the models and the validation's document."""

import json
from pathlib import Path

import numpy as np
import pytest

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.service.cli.parser import main
from pneuarm.service.validation.models import (
    ASYMMETRIES_M,
    MOUNTINGS,
    ModelResult,
    all_models,
    as_json,
    compare,
    reference_rod,
    workspace_samples,
)
from pneuarm.service.validation.models_report import errors_table, failures_table
from pneuarm.service.validation.report import SECTIONS, from_module, table1, write_document
from pneuarm.service.validation.text import markdown_table
from tools.rig.arms import paper_arm


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
    assert lines[5].startswith("Identified: l0 171.72 mm, d 38.01 mm")


def test_a_wrong_table_file_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["validate", "table1", "--table", str(tmp_path / "no.csv")]) == 1
    assert "cannot be read" in capsys.readouterr().err


@pytest.fixture(scope="module")
def results() -> dict[str, ModelResult]:
    return {result.name: result for result in compare(paper_arm(), 180.0, 20)}


def test_without_gravity_the_arcs_are_the_rod_and_a_cut_off_series_is_not(
    results: dict[str, ModelResult],
) -> None:
    worst = {name: result.worst_percent["no gravity"] for name, result in results.items()}
    for name in ("Webster and Jones", "Allen", "Della Santina", "pneuarm (L, u, v)"):
        assert worst[name] < 1e-9
    assert worst["Godage, order 11"] < worst["Godage, order 5"]
    assert worst["Godage, order 5"] > 0.1
    assert worst["Jones and Walker, 10 units"] > worst["Jones and Walker"] > 1e-5


def test_with_gravity_every_formula_misses_by_percents(results: dict[str, ModelResult]) -> None:
    for model in all_models():
        for mounting in ("hanging", "sideways"):
            assert results[model.name].mean_percent[mounting] > 2.0
            assert results[model.name].worst_percent[mounting] > 5.0


def test_nan_stands_where_the_formulas_are_singular(results: dict[str, ModelResult]) -> None:
    for name, result in results.items():
        straight = result.near_straight["0"].nan_share
        if name.startswith(("Jones", "Webster")):  # rounding lets some through
            assert 0.5 < straight < 1.0
        else:
            assert straight == (1.0 if name.startswith("the paper") else 0.0)
        assert result.nan_share == 0.0
        assert 0.0 < result.batch_us < result.one_us
    assert 0.0 < results["Webster and Jones"].near_straight["1e-09"].nan_share < 1.0


def test_the_tables_and_the_json_show_every_model(results: dict[str, ModelResult]) -> None:
    listed = list(results.values())
    for text in (errors_table(listed), failures_table(listed)):
        assert len(text.splitlines()) == len(all_models()) + 3
        assert "nan" not in text
    assert "**NaN**" in failures_table(listed)
    loaded = json.loads(json.dumps(as_json(listed), allow_nan=False))
    assert loaded[0]["mean_percent"].keys() == MOUNTINGS.keys()
    assert len(loaded[0]["near_straight"]) == len(ASYMMETRIES_M)


def test_the_samples_keep_the_limits_and_repeat() -> None:
    arm = paper_arm()
    samples = workspace_samples(arm, 500, seed=3)
    assert samples.shape == (500, 1, 3)
    assert samples.min() > 0.1
    assert samples.max() < 0.3
    np.testing.assert_array_equal(samples, workspace_samples(arm, 500, seed=3))
    spread = samples - samples.mean(axis=-1, keepdims=True)
    bend = np.sqrt(2.0 / 3.0) * np.linalg.norm(spread, axis=-1) / 0.038
    assert 0.9 * 2.5 < bend.max() <= 2.5


def test_wrong_arguments_are_refused() -> None:
    with pytest.raises(InvalidInput, match="count = 0"):
        workspace_samples(paper_arm(), 0)
    with pytest.raises(InvalidInput, match="weight_over_bending_per_m3 = -1"):
        reference_rod(paper_arm(), -1.0)


def test_the_document_holds_its_sections_in_order(tmp_path: Path) -> None:
    missing = from_module("Elsewhere", "tools.validation.not_there.at_all")
    path = write_document(tmp_path / "docs", (table1, missing, lambda: "## Last"))
    titles = [line for line in path.read_text().splitlines() if line.startswith("#")]
    assert titles[0] == "# Validation"
    assert titles[2:] == ["## Elsewhere", "## Last"]
    assert "no module `tools.validation.not_there.at_all`" in path.read_text()


def test_a_section_that_exists_but_breaks_is_not_taken_for_a_missing_one() -> None:
    with pytest.raises(AttributeError):
        from_module("Arms", "tools.rig.arms")()


def test_every_part_of_the_validation_has_its_section() -> None:
    assert len(SECTIONS) == 6


def test_markdown_tables_are_aligned() -> None:
    text = markdown_table(["a", "long"], [["xyz", "1"]])
    assert text.splitlines() == ["| a   | long |", "|-----|------|", "| xyz | 1    |"]

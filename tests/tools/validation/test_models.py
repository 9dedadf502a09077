"""The models of other authors beside the rod: what gravity and a straight arm do to each."""

import json

import numpy as np
import pytest

from pneuarm.controllers.arm.errors import InvalidInput
from tools.rig.arms import paper_arm
from tools.validation.models import (
    ASYMMETRIES_M,
    MOUNTINGS,
    ModelResult,
    all_models,
    as_json,
    compare,
    reference_rod,
    workspace_samples,
)
from tools.validation.models_report import errors_table, failures_table


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

"""The figures of the kinematics over fewer samples than ``make validate`` takes."""

import pytest

from tools.validation.figures_kinematics import ASYMMETRIES_M, all_figures

LIMITS = {
    "chain_and_eq1_m": 1e-12,
    "singularity_free_and_eq1_m": 1e-12,
    "singularity_free_and_chain_m": 1e-12,
    "rotations": 1e-12,
    "straight_and_precise_m": 1e-12,
    "straight_and_precise_relative": 1e-12,
    "smooth_functions_relative": 1e-12,
    "eq2_and_propagation_relative": 1e-9,
    "eq2_and_eq3_relative": 1e-9,
    "eq2_and_numerical_relative": 1e-9,
    "eq2_and_singularity_free_relative": 1e-9,
    "singularity_free_and_numerical_relative": 1e-9,
    "round_trip_m": 1e-12,
    "round_trip_nan": 0.0,
    **{f"round_trip_at_{asymmetry:g}_m": 1e-12 for asymmetry in ASYMMETRIES_M},
    **{f"round_trip_at_{asymmetry:g}_nan": 0.0 for asymmetry in ASYMMETRIES_M},
    "trunk_inverse_worst_m": 1e-3,
}


@pytest.fixture(scope="module")
def figures() -> dict[str, float]:
    return all_figures(2_000)


@pytest.mark.parametrize(("name", "limit"), LIMITS.items(), ids=LIMITS)
def test_a_figure_keeps_its_limit(figures: dict[str, float], name: str, limit: float) -> None:
    assert figures[name] <= limit


def test_every_figure_is_held_to_something(figures: dict[str, float]) -> None:
    assert set(figures) == {*LIMITS, "samples", "trunk_inverse_met_share"}
    assert figures["trunk_inverse_met_share"] > 0.95

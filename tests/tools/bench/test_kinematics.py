"""The benchmark runs and says what it is asked to, also without its peers."""

import pytest

from tools.bench import kinematics


def test_every_figure_is_there_and_null_where_soromox_is_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name, value in {"BATCH": 2000, "SMALL": 100, "SINGLE_CALLS": 10, "SMALL_CALLS": 2}.items():
        monkeypatch.setattr(kinematics, name, value)
    monkeypatch.setattr(kinematics, "soromox", dict)
    figures = kinematics.figures(2)
    for name in ("fk_jacobian_us", "batch_fk_per_s", "three_sections_times_slower"):
        assert isinstance(figures[name], float)
    for name in ("soromox_fk_jacobian_us", "soromox_batch_fk_per_s", "batch_fk_times_faster"):
        assert figures[name] is None

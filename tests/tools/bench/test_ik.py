"""The benchmark runs and says what it is asked to, also without its peers."""

import pytest

from tools.bench import ik


def test_every_figure_is_there_and_null_where_no_peer_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ik, "STEPS_A_TARGET", 20)
    monkeypatch.setattr(ik, "peers", lambda: None)
    figures = ik.figures(1)
    for name in ("ik_us", "ik_3_sections_us", "ik_6_sections_us", "ik_at_limits_us"):
        found = figures[name]
        assert isinstance(found, dict)
        assert 0.0 < found["p50"] <= found["p99"] <= found["p999"]
    assert figures["ik_us"]["osqp_share"] < figures["ik_at_limits_us"]["osqp_share"]  # type: ignore[index]
    assert figures["peers_us"] == {}
    assert figures["times_faster_than_fastest_peer"] is None

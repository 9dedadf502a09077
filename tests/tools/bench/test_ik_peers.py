"""The peers of the benchmark do what is timed: they follow the target inside their limits."""

import importlib.util
import itertools

import numpy as np
import pytest

from tools.bench import ik_peers

PACKAGES = ("pinocchio", "pink", "mujoco", "mink", "qpsolvers")
MISSING = [name for name in PACKAGES if importlib.util.find_spec(name) is None]


@pytest.mark.skipif(bool(MISSING), reason=f"make bench-setup; missing: {MISSING}")
def test_every_peer_with_every_solver_reaches_the_target() -> None:
    peers = ik_peers.peers()
    assert {name.split()[0] for name in peers} == {"pin-pink", "mink"}
    path = list(itertools.islice(ik_peers.targets(), 500))
    assert np.linalg.norm(path[-1] - path[0]) > ik_peers.RADIUS_M
    for name, peer in peers.items():
        ik_peers.follow(peer, iter(path), len(path))
        np.testing.assert_allclose(peer.tip_m(), path[-1], atol=1e-6, err_msg=name)


@pytest.mark.skipif(bool(MISSING), reason=f"make bench-setup; missing: {MISSING}")
def test_a_target_too_fast_is_followed_at_the_speed_limit() -> None:
    for name, peer in ik_peers.peers().items():
        before = peer.tip_m().copy()
        peer.aim(before + np.array([0.0, 0.0, 0.05]))
        peer.step()
        moved_m = np.linalg.norm(peer.tip_m() - before)
        # The limits are on the joints: chord and tilt at their speeds, at right angles.
        bound_m = np.hypot(0.2, 2.6 * np.linalg.norm(before)) * ik_peers.PERIOD_S
        assert 0.1e-3 < moved_m < 1.01 * bound_m, name


def test_without_the_peers_one_sentence_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing() -> list[str]:
        raise ModuleNotFoundError("No module named 'qpsolvers'", name="qpsolvers")

    monkeypatch.setattr(ik_peers, "solvers", missing)
    monkeypatch.setattr("sys.argv", ["ik_peers", "--json"])
    assert ik_peers.main() == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert all(fact in said.err for fact in ("qpsolvers", "make bench-setup"))

"""What somebody may cost; the time is an argument."""

from hypothesis import given
from hypothesis import strategies as st

from pneuarm.service.wire.allowance import Allowance


def test_it_fills_with_time_and_no_further_than_a_second() -> None:
    allowance = Allowance(20.0)
    assert sum(allowance.take(5.0) for _ in range(100)) == 20
    assert sum(allowance.take(5.5) for _ in range(100)) == 10
    assert sum(allowance.take(1e6) for _ in range(100)) == 20


def test_a_debt_is_paid_by_time() -> None:
    allowance = Allowance(0.1)
    allowance.spend(0.3, 0.0)
    assert allowance.left(1.9) < 0.0
    assert allowance.left(2.1) > 0.0


def test_time_that_runs_backwards_gives_nothing() -> None:
    allowance = Allowance(1.0)
    assert allowance.take(10.0)
    assert not allowance.take(9.0)
    assert not allowance.take(10.0)


@given(st.lists(st.tuples(st.floats(0, 5), st.floats(0, 0.05)), max_size=200))
def test_in_the_long_run_no_more_is_spent_than_fills(steps: list[tuple[float, float]]) -> None:
    allowance, now_s, spent = Allowance(0.1), 0.0, 0.0
    for pause_s, cost in steps:
        now_s += pause_s
        if allowance.left(now_s) > 0.0:
            allowance.spend(cost, now_s)
            spent += cost
    assert spent <= 0.1 * (now_s + 1.0) + 0.05 + 1e-9

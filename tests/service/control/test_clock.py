"""Deadlines are multiples of the period, whatever the sleeping does; on a clock of the test's."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.service.control.clock import Clock

MS = 1_000_000


class FakeTime:
    """Time that passes by sleeping, a little by looking, and when the test says so."""

    def __init__(self, oversleep_ns: int = 0, look_ns: int = 100) -> None:
        self.now_ns = 10**12 + 7
        self.oversleep_ns, self._look_ns = oversleep_ns, look_ns
        self.slept_ns: list[int] = []
        self.looks = 0

    def monotonic_ns(self) -> int:
        self.now_ns += self._look_ns
        self.looks += 1
        return self.now_ns

    def sleep(self, seconds: float) -> None:
        assert seconds > 0
        self.slept_ns.append(round(seconds * 1e9))
        self.now_ns += round(seconds * 1e9) + self.oversleep_ns


def clock_of(
    monkeypatch: pytest.MonkeyPatch, fake: FakeTime, rate_hz: float = 1000.0, spin_us: float = 120.0
) -> tuple[Clock, int]:
    monkeypatch.setattr("pneuarm.service.control.clock.time", fake)
    clock = Clock(rate_hz, spin_us)
    return clock, fake.now_ns


@pytest.mark.parametrize("rate_hz", [50.0, 300.0, 1000.0])
@pytest.mark.parametrize("busy_share", [0.0, 0.3, 0.9])
def test_deadlines_are_multiples_of_the_period(
    monkeypatch: pytest.MonkeyPatch, rate_hz: float, busy_share: float
) -> None:
    fake = FakeTime()
    clock, start_ns = clock_of(monkeypatch, fake, rate_hz)
    period_ns = round(1e9 / rate_hz)
    for number in range(1, 200):
        wake = clock.wait()
        assert wake.due_ns == start_ns + number * period_ns
        assert wake.skipped == 0
        assert 0 <= wake.late_ns <= 200
        fake.now_ns += int(busy_share * period_ns)


def test_it_sleeps_to_shortly_before_and_spins_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    fake = FakeTime()
    clock, _ = clock_of(monkeypatch, fake, spin_us=120.0)
    looks = fake.looks
    clock.wait()
    (slept_ns,) = fake.slept_ns
    assert slept_ns == pytest.approx(MS - 120_000, abs=500)
    assert fake.looks - looks > 1000  # 120 us at 100 ns a look


def test_without_spinning_it_sleeps_to_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    fake = FakeTime()
    clock, _ = clock_of(monkeypatch, fake, spin_us=0.0)
    clock.wait()
    assert fake.slept_ns[0] == pytest.approx(MS, abs=500)
    assert fake.looks < 10


def test_waking_late_is_measured_and_does_not_move_the_deadlines(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fake = FakeTime(oversleep_ns=300_000)  # more than the spinning takes
    clock, start_ns = clock_of(monkeypatch, fake)
    for number in range(1, 50):
        wake = clock.wait()
        assert wake.due_ns == start_ns + number * MS
        assert wake.late_ns == pytest.approx(180_000, abs=1000)
        assert wake.skipped == 0


@pytest.mark.parametrize(
    ("late_ns", "skipped"), [(MS // 2, 0), (MS - 1000, 0), (MS + MS // 2, 1), (25 * MS + 1000, 25)]
)
def test_deadlines_that_are_past_are_skipped_and_counted(
    monkeypatch: pytest.MonkeyPatch, late_ns: int, skipped: int
) -> None:
    fake = FakeTime()
    clock, start_ns = clock_of(monkeypatch, fake)
    first = clock.wait()
    assert first.due_ns == start_ns + MS
    fake.now_ns = first.due_ns + MS + late_ns  # a tick that took too long
    wake = clock.wait()
    assert wake.skipped == skipped
    assert wake.due_ns == start_ns + (2 + skipped) * MS
    assert 0 <= wake.late_ns < MS
    after = clock.wait()
    assert (after.skipped, after.due_ns) == (0, wake.due_ns + MS)


@given(st.lists(st.integers(0, 20 * MS), min_size=1, max_size=30))
def test_every_deadline_is_waited_for_or_counted(busy_ns: list[int]) -> None:
    with pytest.MonkeyPatch.context() as monkeypatch:
        fake = FakeTime()
        clock, start_ns = clock_of(monkeypatch, fake)
        skipped = 0
        for number, busy in enumerate(busy_ns, 1):
            wake = clock.wait()
            skipped += wake.skipped
            assert wake.due_ns == start_ns + (number + skipped) * MS
            fake.now_ns += busy

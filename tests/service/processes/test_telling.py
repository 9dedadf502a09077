"""What repeats is told once and counted; the time is the events'."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.processes.telling import Telling

MS = 1_000_000
S = 1000 * MS


def event(at_ns: int, text: str = "refused", client: str = "", mode: int = 3) -> pb.Event:
    return pb.Event(time_unix_ns=at_ns, code="rejected", text=text, client_id=client, mode=mode)


class Told(list[pb.Event]):
    """A telling with what it has told."""

    def __init__(self) -> None:
        super().__init__()
        self.telling = Telling(self.append)


def test_the_first_is_told_at_once_and_the_rest_once_a_second_with_its_number() -> None:
    told = Told()
    for ms in range(0, 11_000, 10):
        told.telling.tell(event(ms * MS))
        told.telling.step(ms * MS)
    assert told[0].repeats == 0
    assert len(told) == 11
    assert all(b.time_unix_ns - a.time_unix_ns >= S for a, b in pairwise(told))
    told.telling.step(20 * S)
    assert 1 + sum(each.repeats for each in told) == 1100


def test_numbers_make_no_difference_words_do() -> None:
    told = Told()
    for n in range(50):
        told.telling.tell(event(n * MS, f"sequence {n} is not above {n + 1}, -1.5e-{n} or nan"))
    assert len(told) == 1
    told.telling.tell(event(60 * MS, "frame_id is unknown"))
    told.telling.tell(event(60 * MS, "frame_id is unknown", client="another"))
    assert len(told) == 3


def test_the_newest_of_those_that_were_counted_is_told() -> None:
    told = Told()
    for n in range(5):
        told.telling.tell(event(n * MS, f"number {n}"))
    told.telling.step(2 * S)
    assert [each.text for each in told] == ["number 0", "number 4"]
    assert told[1].time_unix_ns == 2 * S


def test_what_happens_again_after_a_while_is_news() -> None:
    told = Told()
    for second in (0, 5, 10):
        told.telling.tell(event(second * S))
        told.telling.step((second + 2) * S)
    assert [each.repeats for each in told] == [0, 0, 0]


def test_a_change_of_mode_is_always_told() -> None:
    told = Told()
    for n in range(100):
        told.telling.tell(event(n * MS, mode=3 + n % 2))
    assert len(told) == 100


def test_many_different_ones_are_counted_together() -> None:
    told = Told()
    for n in range(117_000):
        told.telling.tell(event(n * 8_000, "refused", client=f"stranger-{n}"))
    told.telling.step(3 * S)
    assert len(told) < 70
    summed = [each for each in told if each.code == "not_told"]
    assert summed
    assert len(told) - len(summed) + sum(each.repeats for each in summed) == 117_000


@given(
    st.lists(
        st.tuples(
            st.integers(0, 500), st.sampled_from("abcdefgh"), st.text(max_size=3), st.integers(3, 4)
        ),
        max_size=300,
    )
)
def test_nothing_is_lost_and_little_is_told(
    steps: list[tuple[int, str, str, int]],
) -> None:
    told, now_ns, changes, mode = Told(), 0, 0, 0
    for ms, text, client, new_mode in steps:
        now_ns += ms * MS
        changes, mode = changes + (new_mode != mode), new_mode
        told.telling.tell(event(now_ns, text, client, new_mode))
        told.telling.step(now_ns)
    told.telling.step(now_ns + 2 * S)
    told.telling.step(now_ns + 4 * S)
    firsts = sum(1 for each in told if not each.repeats)
    assert firsts + sum(each.repeats for each in told) == len(steps)
    assert len(told) <= changes + 42 * (now_ns / S + 3)

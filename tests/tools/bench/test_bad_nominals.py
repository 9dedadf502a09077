"""A share of the wrong configurations: none is accepted that is much worse than the right one."""

import pytest

from tools.bench.bad_nominals import Recorder, cases, is_wrong, judged

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]


def test_a_wrong_configuration_is_refused_or_found() -> None:
    recorder = Recorder("paper", 0, quick=True)
    every = {case.name: case for case in cases(1)}
    right = judged(recorder, every["right"])
    assert not right.refused
    assert right.share < 0.01
    seeded = [name for name in every if name.startswith("seed ")]
    for name in ("lengthening_mm_per_bar x 0.1", *seeded):
        row = judged(recorder, every[name])
        assert not is_wrong(row, right), row

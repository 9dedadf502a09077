"""Shapes from the prompt: what cannot be run is refused in one sentence, before any daemon."""

from pathlib import Path

import pytest

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.cli.parser import build_parser
from pneuarm.service.cli.shape_arguments import duration_s, shape_of
from pneuarm.service.cli.values import UsageError

CIRCLE = ("circle", "0", "0", "200", "40")
LINE = ("line", "-40", "0", "200", "40", "0", "200")


def shape(*words: str) -> pb.Target:
    return shape_of(build_parser().parse_args(["send", *words]), pb.DEFAULT)


@pytest.mark.parametrize("value", ["0", "-1", "nan", "inf"])
@pytest.mark.parametrize(
    ("words", "option"),
    [(CIRCLE, "frequency"), (CIRCLE, "turns"), (LINE, "period"), (LINE, "repeats")],
)
def test_what_takes_no_time_or_no_end_of_it_is_refused(
    words: tuple[str, ...], option: str, value: str
) -> None:
    with pytest.raises(UsageError) as refused:
        shape(*words, f"--{option}={value}")
    assert all(fact in str(refused.value) for fact in (f"--{option}", repr(value), "above 0"))


def test_a_shape_takes_its_time() -> None:
    assert duration_s(shape(*CIRCLE, "--frequency", "0.5", "--turns", "3")) == pytest.approx(6.0)
    assert duration_s(shape(*LINE, "--period", "2", "--repeats", "1.5")) == pytest.approx(3.0)


@pytest.mark.parametrize("line", ["1 2 nan 3", "inf 0 0 200", "1 2 3", "a b c d"])
def test_a_line_of_waypoints_holds_four_finite_numbers(tmp_path: Path, line: str) -> None:
    path = tmp_path / "points.csv"
    path.write_text(f"0 0 0 200\n{line}\n")
    with pytest.raises(InvalidInput, match=r"line 2: .*; four numbers are needed"):
        shape("trajectory", str(path))

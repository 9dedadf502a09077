"""What is kept of a learning: the best trial, from the moment it was gone through."""

from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import ConfigurationError, InvalidInput, LearningDiverges
from pneuarm.controllers.learning.course import Course
from pneuarm.controllers.learning.learning import Learning
from pneuarm.controllers.targets.trajectory import TrajectoryTarget
from pneuarm.service.configuration.configuration import load as load_configuration
from pneuarm.service.learning.command import report
from pneuarm.service.learning.file import load, require_place
from pneuarm.service.learning.keeping import Keeper
from pneuarm.service.learning.learn import learn
from pneuarm.service.learning.telling import Telling
from tools.bench.learning import circle


def keeper(path: Path, trials: int) -> Keeper:
    learning = Learning(Course(circle(0.25)), 0.04, 2.2)
    telling = Telling(learning, trials, 10.0)
    return Keeper(learning, load_configuration(), "circle.csv", path, telling)


def go_through(
    keeping: Keeper, pushed_m: list[float], before: Callable[[int], object] = lambda done: None
) -> None:
    """Trials in which the tip is so far from where it is wanted; ``before`` each, trials done."""
    pushes, wanted_m = iter(pushed_m), keeping.learning.course.wanted_m

    def follow(_: TrajectoryTarget) -> Array:
        before(len(keeping.learning.trials))
        return wanted_m - np.array([0.0, 0.0, next(pushes)])

    with keeping.saying_what_is_kept():
        learn(keeping.learning, len(pushed_m), follow, keeping.take)


def test_every_best_trial_is_written_at_once_and_no_other(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "learned.toml"
    keeping, written = keeper(path, 5), list[int]()
    go_through(
        keeping,
        [0.01, 0.004, 0.005, 0.002, 0.003],
        lambda done: written.append(len(load(path).trials) if path.exists() else 0),
    )
    assert written == [0, 0, 2, 2, 4]
    told = capsys.readouterr().err.splitlines()
    assert [line for line in told if "trial" in line] == told
    for number, (line, rms) in enumerate(
        zip(told, ("10.00", "4.00", "5.00", "2.00", "3.00"), strict=True)
    ):
        assert f"trial {number + 1} of 5" in line
        assert f"RMS {rms} mm" in line
    assert "40 s left" in told[0]


def test_a_learning_that_diverges_tells_every_trial_and_keeps_the_best(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "learned.toml"
    keeping = keeper(path, 10)
    with pytest.raises(LearningDiverges):
        go_through(keeping, [0.01, 0.004, 0.03, 0.04, *[0.0] * 6])
    assert [row.rms_mm for row in load(path).trials] == pytest.approx([10.0, 4.0])
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 5
    for line, rms in zip(told[2:4], ("30.00", "40.00"), strict=True):
        assert all(fact in line for fact in (f"RMS {rms} mm", "worse than trial 2", "undone"))
    assert all(fact in told[4] for fact in (str(path), "RMS 4.00 mm"))


def test_nothing_is_kept_of_a_learning_that_never_was_better_and_that_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "learned.toml"
    with pytest.raises(LearningDiverges):
        go_through(keeper(path, 4), [0.004, 0.03, 0.03, 0.0])
    assert not path.exists()
    assert "nothing is kept" in capsys.readouterr().err.splitlines()[-1]


def test_a_disk_that_takes_nothing_ends_it_with_the_path_and_what_was_kept_before(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "there"
    folder.mkdir()
    keeping = keeper(folder / "learned.toml", 4)

    def vanishes(done: int) -> None:
        if done == 2:
            folder.rename(tmp_path / "elsewhere")
            folder.write_text("no folder")

    with pytest.raises(ConfigurationError, match=r"learned\.toml"):
        go_through(keeping, [0.01, 0.004, 0.003, 0.002], vanishes)
    assert "RMS 4.00 mm" in capsys.readouterr().err.splitlines()[-1]
    assert len(load(tmp_path / "elsewhere" / "learned.toml").trials) == 2


def test_what_is_told_of_a_trial_that_is_gone_through_again_says_which_and_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keeper(tmp_path / "x.toml", 5).telling.again("out of sight")
    told = capsys.readouterr().err
    assert all(fact in told for fact in ("trial 1 of 5", "again", "out of sight"))


@pytest.mark.parametrize(
    ("pushed_m", "facts", "missing"),
    [
        ([0.01, 0.004], ("10.00 mm", "4.00 mm", "--learned", "--enable"), "time_constant_ms"),
        ([0.01, 0.009], ("10.00 mm", "9.00 mm", "--learned", "time_constant_ms"), "nothing"),
        ([0.01, 0.012], ("10.00 mm", "nothing was learnt"), "--learned"),
    ],
)
def test_the_report_says_what_it_was_worth(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    pushed_m: list[float],
    facts: tuple[str, ...],
    missing: str,
) -> None:
    keeping = keeper(tmp_path / "learned.toml", 2)
    go_through(keeping, pushed_m)
    arguments = Namespace(json=False, trajectory=Path("circle.csv"), arm="paper")
    report(arguments, keeping.learning, keeping.output, "")
    told = capsys.readouterr().out
    assert all(fact in told for fact in facts)
    assert missing not in told


@pytest.mark.parametrize(
    "content", ["0, 0, 0, 200\n1, 0, 0, 200\n", "[arm]\nname = 'paper'\n", None]
)
def test_no_other_file_is_written_over(tmp_path: Path, content: str | None) -> None:
    path = tmp_path / "mine"
    if content is None:
        path.mkdir()
    else:
        path.write_text(content)
    with pytest.raises(InvalidInput) as told:
        require_place(path)
    assert all(fact in str(told.value) for fact in (str(path), "--output", "pneuarm learn"))
    if content is not None:
        assert path.read_text() == content


def test_what_was_learnt_before_may_be_written_over(tmp_path: Path) -> None:
    path = tmp_path / "new" / "learned.toml"
    require_place(path)
    assert path.parent.is_dir()
    go_through(keeper(path, 2), [0.01, 0.004])
    require_place(path)
    assert np.abs(load(path).offset_m).max() > 1e-3

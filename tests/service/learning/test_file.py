"""The file of what was learnt: it is whole, and fits one arm and one trajectory."""

from pathlib import Path

import numpy as np
import pytest

from pneuarm.controllers.arm.errors import InvalidInput, LearningError
from pneuarm.controllers.learning.course import Course
from pneuarm.controllers.learning.learning import Learning
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.target_messages import trajectory_target
from pneuarm.service.configuration.configuration import Configuration, load
from pneuarm.service.learning import file
from pneuarm.service.learning.apply import checked, with_learned
from pneuarm.service.learning.waypoints import read_waypoints
from tools.bench.learning import circle
from tools.rig.daemon import ROOT

CONFIGURATION = load()


def message(frequency_hz: float = 0.25) -> pb.Target:
    shape = circle(frequency_hz)
    return trajectory_target(zip(shape.times_s, shape.positions_m, strict=True), 5, pb.QP_IK)


def learnt(configuration: Configuration = CONFIGURATION) -> Learning:
    course = Course(checked(configuration, message()))
    learning = Learning(course, 0.02, 2.2)
    learning.take(course.wanted_m - [0.0, 0.0, 0.01])
    learning.take(course.wanted_m - [0.0, 0.0, 0.001])
    assert learning.has_learnt
    return learning


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    path = tmp_path / "circle-learned.toml"
    file.save(path, "circle.csv", learnt(), CONFIGURATION)
    return path


def test_what_is_written_is_read_again(saved: Path) -> None:
    learning, read = learnt(), file.load(saved)
    offset = learning.course.at_waypoints(learning.best.offset_m)
    np.testing.assert_allclose(read.offset_m, offset, atol=1e-7)
    assert read.arm == "paper"
    assert read.trajectory_sha256 == learning.course.digest
    assert [row.rms_mm for row in read.trials] == pytest.approx([10.0, 1.0])
    assert [path.name for path in saved.parent.iterdir()] == [saved.name]


def test_the_trajectory_is_sent_with_it(saved: Path) -> None:
    sent = with_learned(message(), saved, CONFIGURATION)
    assert (sent.trajectory.id, sent.law) == (5, pb.QP_IK)
    learning = learnt()
    expected = learning.course.shifted(learning.best.offset_m)
    found = [(p.position_m.x, p.position_m.y, p.position_m.z) for p in sent.trajectory.waypoints]
    np.testing.assert_allclose(found, expected.positions_m, atol=1e-7)
    assert max(abs(z - 0.2) for _, _, z in found) > 0.005
    checked(CONFIGURATION, sent)


def test_it_fits_no_other_trajectory_arm_or_calibration(saved: Path) -> None:
    arm = CONFIGURATION.arm
    other_name = arm.model_copy(update={"name": "other"})
    section = arm.sections[0].model_copy(update={"rest_length_mm": 201.0})
    other_fit = arm.model_copy(update={"sections": (section,)})
    for sent, table, what in (
        (message(0.3), arm, "trajectory"),
        (message(), other_name, "arm"),
        (message(), other_fit, "configuration"),
    ):
        configuration = CONFIGURATION.model_copy(update={"arm": table})
        with pytest.raises(InvalidInput) as told:
            with_learned(sent, saved, configuration)
        assert all(fact in str(told.value) for fact in (what, saved.name, "learn"))


def test_offsets_beyond_the_bound_are_refused(saved: Path) -> None:
    feedback = CONFIGURATION.feedback.model_copy(update={"learned_max_share": 0.01})
    small = CONFIGURATION.model_copy(update={"feedback": feedback})
    with pytest.raises(InvalidInput) as told:
        with_learned(message(), saved, small)
    assert all(fact in str(told.value) for fact in ("learned_max_share", "2.0 mm", saved.name))


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("arm = ", "arm_ = ", "arm"),
        ('trajectory_sha256 = "', 'trajectory_sha256 = "x', "trajectory_sha256"),
        ("rms_mm = 10.0", "rms_mm = -1.0", "trials.0.rms_mm"),
        ("    [0.0000, 0.0000,", "    [nan, 0.0000,", "offsets.0.0"),
        ("    [0.0000, 0.0000,", "    [0.0000,", "offsets.0"),
        ("offsets = [", "offsets = [[", "Unclosed"),
    ],
)
def test_what_is_wrong_with_a_file_is_named(saved: Path, old: str, new: str, named: str) -> None:
    text = saved.read_text()
    assert old in text
    saved.write_text(text.replace(old, new, 1))
    with pytest.raises(InvalidInput) as told:
        file.load(saved)
    assert "pneuarm learn" in str(told.value)
    assert saved.name in str(told.value)
    assert named.lower() in str(told.value).lower()
    assert "\n" not in str(told.value)


def test_a_row_less_is_another_course(saved: Path) -> None:
    lines = saved.read_text().splitlines(keepends=True)
    lines.remove(next(line for line in lines if line.startswith("    [0.05")))
    saved.write_text("".join(lines))
    with pytest.raises(InvalidInput, match="offsets"):
        with_learned(message(), saved, CONFIGURATION)


def test_nothing_is_saved_of_no_trial(tmp_path: Path) -> None:
    fresh = Learning(Course(circle(0.25)), 0.02, 2.2)
    with pytest.raises(LearningError):
        file.save(tmp_path / "x.toml", "x.csv", fresh, CONFIGURATION)
    assert list(tmp_path.iterdir()) == []


def test_a_file_of_waypoints_is_that_of_send(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("# time, x, y, z\n0, 0, 0, 200\n\n1.5 10 -20 190\n")
    assert read_waypoints(path) == [(0.0, [0.0, 0.0, 0.2]), (1.5, [0.01, -0.02, 0.19])]


def test_the_trajectory_of_the_page_can_be_learnt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (ROOT / "docs" / "learning.md").read_text()
    monkeypatch.chdir(tmp_path)
    exec(page.split("```python\n")[1].split("```")[0], {})  # the page's own lines
    (written,) = tmp_path.iterdir()
    course = Course(checked(CONFIGURATION, trajectory_target(read_waypoints(written))))
    assert f"pneuarm learn {written.name} " in page
    assert np.linalg.norm(course.wanted_m[:, :2], axis=1) == pytest.approx(0.04, abs=1e-4)


def test_only_a_trajectory_is_learnt() -> None:
    with pytest.raises(InvalidInput, match="circle"):
        checked(
            CONFIGURATION,
            pb.Target(
                circle=pb.CircleTarget(
                    frame_id="base",
                    center_m=pb.Vector3(z=0.2),
                    radius_m=0.03,
                    frequency_hz=0.2,
                )
            ),
        )

"""The course: what is sent is what is wanted, with the offsets added and time around it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuarm.controllers.arm.errors import InvalidInput, LearningError, TrialLost
from pneuarm.controllers.learning.course import MARGIN_S, Course
from pneuarm.controllers.targets.trajectory import MAX_WAYPOINTS, TrajectoryTarget
from tests.controllers.learning.plants import bow

WANTED = bow()
COURSE = Course(WANTED)


def test_without_offsets_what_is_wanted_is_sent_a_margin_later() -> None:
    sent = COURSE.shifted(np.zeros_like(COURSE.wanted_m), 7)
    assert sent.id == 7
    assert len(sent.times_s) <= MAX_WAYPOINTS
    for time_s in np.linspace(-1.0, WANTED.duration_s + 1.0, 200).tolist():
        there, wanted = sent.at(time_s + MARGIN_S), WANTED.at(time_s)
        np.testing.assert_allclose(there.position, wanted.position, atol=1e-4)
    assert sent.duration_s == pytest.approx(WANTED.duration_s + 2.0 * MARGIN_S)


@given(st.lists(st.floats(-0.01, 0.01), min_size=3, max_size=3))
@settings(max_examples=20, deadline=None)
def test_offsets_are_added_where_they_are_known(offset: list[float]) -> None:
    sent = COURSE.shifted(np.tile(offset, (len(COURSE.times_s), 1)))
    for time_s in np.linspace(0.0, WANTED.duration_s, 50).tolist():
        wanted = np.array(WANTED.at(time_s).position) + offset
        np.testing.assert_allclose(sent.at(time_s + MARGIN_S).position, wanted, atol=1e-4)


def test_the_time_before_the_first_waypoint_is_left_out() -> None:
    late = TrajectoryTarget(tuple(t + 5.0 for t in WANTED.times_s), WANTED.positions_m)
    np.testing.assert_allclose(Course(late).wanted_m, COURSE.wanted_m, atol=1e-12)


def test_only_what_is_under_way_is_judged() -> None:
    judged = COURSE.times_s[COURSE.judged]
    assert judged[0] == pytest.approx(MARGIN_S)
    assert judged[-1] == pytest.approx(MARGIN_S + WANTED.duration_s)


def test_the_digest_is_that_of_the_motion_and_of_no_other() -> None:
    again = TrajectoryTarget(WANTED.times_s, WANTED.positions_m, 5)
    assert Course(again).digest == COURSE.digest
    x, y, z = WANTED.positions_m[3]
    moved = (*WANTED.positions_m[:3], (x, y + 1e-6, z), *WANTED.positions_m[4:])
    assert Course(TrajectoryTarget(WANTED.times_s, moved)).digest != COURSE.digest
    assert Course(bow(7.0)).digest != COURSE.digest


def test_what_too_few_waypoints_would_stand_for_is_refused() -> None:
    times_s = np.linspace(0.0, 60.0, MAX_WAYPOINTS)
    zigzag = tuple((0.02 * (-1.0) ** i, 0.0, 0.2) for i in range(MAX_WAYPOINTS))
    with pytest.raises(LearningError) as told:
        Course(TrajectoryTarget(tuple((times_s**1.05).tolist()), zigzag))
    assert all(fact in str(told.value) for fact in (f"{MAX_WAYPOINTS} waypoints", "1 mm", "pieces"))
    with pytest.raises(LearningError) as told:
        Course(bow(0.5))
    assert all(fact in str(told.value) for fact in ("31 waypoints", "1 mm", "more time"))


@pytest.mark.parametrize("count", [0, 1, 5])
def test_offsets_of_another_course_are_refused(count: int) -> None:
    with pytest.raises(InvalidInput, match=str(len(COURSE.waypoint_times_s))):
        COURSE.shifted_at_waypoints(np.zeros((count, 3)))


def test_measured_tips_come_onto_the_grid_and_a_gap_is_told() -> None:
    taken_s = np.arange(-0.1, COURSE.duration_s + 0.1, 0.033)
    tips = np.outer(taken_s, [1.0, 2.0, 3.0])
    expected = np.outer(COURSE.times_s, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(COURSE.on_grid(taken_s, tips), expected, atol=1e-9)
    for seen in (taken_s < 3.0, taken_s > 1.0, np.abs(taken_s - 3.0) > 0.2):
        with pytest.raises(TrialLost, match="marker"):
            COURSE.on_grid(taken_s[seen], tips[seen])
    with pytest.raises(TrialLost, match="marker"):
        COURSE.on_grid(taken_s[:0], tips[:0])

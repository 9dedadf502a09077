"""Shapes from the wire: what is refused, and in which words."""

from dataclasses import replace

import numpy as np
import pytest

from pneuarm.controllers.arm.errors import TargetRejected
from pneuarm.controllers.targets.targets import TrajectoryTarget
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.target_messages import circle_target, line_target, trajectory_target
from pneuarm.service.wire.target_checks import TargetChecker
from tools.rig.arms import paper_arm

CHECKER = TargetChecker(paper_arm())
HOME = (0.0, 0.0, 0.2)


def test_a_shape_is_another_with_another_id_or_content_alone() -> None:
    one = CHECKER.target(circle_target(HOME, 0.02, 0.5))
    assert CHECKER.target(circle_target(HOME, 0.02, 0.5)) == one
    assert CHECKER.target(circle_target(HOME, 0.02, 0.5, law=pb.RESOLVED_RATE)) == one
    assert CHECKER.target(circle_target(HOME, 0.02, 0.5, shape_id=1)) != one
    assert CHECKER.target(circle_target(HOME, 0.02, 0.4)) != one


def test_waypoints_are_taken_as_they_come() -> None:
    target = CHECKER.target(trajectory_target([(0.5, HOME), (1.5, (0.02, 0.0, 0.2))]))
    assert isinstance(target, TrajectoryTarget)
    assert target.duration_s == 1.5


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (trajectory_target([(0.0, HOME)]), "1 waypoints; 2 to 200"),
        (trajectory_target([(0.0, HOME)] * 201), "201 waypoints"),
        (trajectory_target([(1.0, HOME), (0.5, HOME)]), "waypoint 2 is at 0.5 s"),
        (trajectory_target([(-1.0, HOME), (0.5, HOME)]), "0 to 3600 s"),
        (
            trajectory_target([(1.0, HOME), (3.0, (0.3, 0.0, 0.1))]),
            r"waypoint 2 at \(300.0, 0.0, 100.0\) mm is out of reach; the nearest .* mm away",
        ),
        (
            trajectory_target([(0.0, HOME), (0.1, (0.05, 0.0, 0.2))]),
            "mm/s along an axis; allowed are 283 .reference.speed_max_mm_s",
        ),
        (circle_target(HOME, 0.0, 1.0), "radius_m = 0"),
        (circle_target(HOME, 0.02, -1.0), "frequency_hz = -1"),
        (circle_target(HOME, 0.02, 1.0, turns=-1.0), "turns = -1: 0 .without end. or more"),
        (circle_target(HOME, 0.02, 1.0, normal=(0.0, 0.0, 0.0)), "normal = .* points nowhere"),
        (circle_target((0.0, 0.0, 0.2), 0.25, 0.05), "the point at .* is out of reach"),
        (circle_target((40.0, 0.0, 200.0), 20.0, 1.0), "is it in mm"),
        (line_target(HOME, (0.03, 0.0, 0.2), 0.0), "period_s = 0"),
        (line_target(HOME, (0.03, 0.0, 0.2), 0.01), "along an axis"),
        (line_target((float("nan"), 0.0, 0.2), HOME, 1.0), "finite"),
        # Powers and quotients of these are not finite.
        (circle_target(HOME, 5e-324, 1e160), "radius_m"),
        (circle_target(HOME, 1e20, 1e-160), "radius_m"),
        (circle_target(HOME, 0.02, 5e-324), "frequency_hz"),
        (circle_target(HOME, 0.02, 1.7e308), "frequency_hz"),
        (line_target(HOME, HOME, 5e-324), "period_s"),
        (line_target(HOME, HOME, 1.7e308), "period_s"),
    ],
)
def test_a_bad_shape_is_refused_in_one_sentence(message: pb.Target, words: str) -> None:
    with pytest.raises(TargetRejected, match=words) as refused:
        CHECKER.target(message)
    assert len(str(refused.value).splitlines()) == 1


def test_a_short_piece_among_long_ones_is_seen() -> None:
    """400 samples of an hour are 9 s apart; this one is at rest but for a second of it."""
    middle = [(1800.0 + 0.05 * n, (0.02 * (n == 0), 0.0, 0.2)) for n in range(-20, 21)]
    with pytest.raises(TargetRejected, match="speed_max_mm_s"):
        CHECKER.target(trajectory_target([(0.0, HOME), *middle, (3600.0, HOME)]))


def test_what_swings_far_between_its_waypoints_is_refused() -> None:
    waypoints = [(0.0, HOME), (1800.0, HOME), (1800.2, (0.004, 0.0, 0.2)), (3600.0, HOME)]
    with pytest.raises(TargetRejected, match=r"arm lengths.*waypoints"):
        CHECKER.target(trajectory_target(waypoints))


def test_reach_is_left_to_the_arm_where_a_tool_is_on_it() -> None:
    checker = TargetChecker(replace(paper_arm(), tool_m=(0.0, 0.0, 0.1)))
    target = checker.target(trajectory_target([(1.0, HOME), (5.0, (0.3, 0.0, 0.1))]))
    assert target.duration_s == 5.0  # type: ignore[union-attr]


def test_a_velocity_of_a_position_is_checked() -> None:
    message = pb.Target()
    message.position.frame_id = "base"
    message.position.position_m.z = 0.2
    message.position.velocity_m_s.x = 40.0
    with pytest.raises(TargetRejected, match=r"velocity_m_s = .* above 5 m/s; is it in mm/s"):
        CHECKER.target(message)
    message.position.velocity_m_s.x = 0.04
    target = CHECKER.target(message)
    assert np.array_equal(target.velocity_m_s, [0.04, 0.0, 0.0])  # type: ignore[union-attr]

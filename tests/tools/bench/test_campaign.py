"""A small share of the campaign of tools/bench/reach.py."""

from tools.bench.reach import acceptance, out_of_reach, reachable
from tools.rig.arms import paper_arm, trunk_arm


def test_reachable_positions_are_reached_within_a_tenth_of_a_millimetre() -> None:
    found = reachable(paper_arm(), 40, seed=30)
    assert (found["reached"], found["violations"], found["fallbacks"]) == (40, 0, 0)


def test_from_and_to_the_straight_arm() -> None:
    found = reachable(paper_arm(), 30, seed=31, around_straight=True)
    assert (found["reached"], found["violations"], found["fallbacks"]) == (30, 0, 0)


def test_the_nearest_point_of_a_position_out_of_reach_is_the_global_one() -> None:
    found = out_of_reach(paper_arm(), 12, seed=32)
    assert (found["within_tolerance"], found["said_so"], found["violations"]) == (12, 12, 0)


def test_osqp_gives_a_usable_result_with_every_limit_active() -> None:
    for arm in (paper_arm(), trunk_arm()):
        found = acceptance(arm, 300, seed=33)
        assert found["accepted"] == 1.0
        assert found["violations"] == 0
        assert {"keep_out", "slew", "acceleration"} <= set(found["touched"])

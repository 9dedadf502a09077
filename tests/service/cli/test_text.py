"""States for people: millimetres, degrees and bar, and which limit binds."""

import pytest

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.cli.text import bars, millimetres, outcome, radians, state_line

STATE = pb.ArmState(
    sequence=12,
    mode=pb.ACTIVE,
    target_kind=pb.POSITION,
    target_position_m=[0.06, 0.02, 0.19],
    reach=pb.OUT_OF_REACH,
    binding_limits=5,
    target_error_m=0.01234,
    tip_estimated_position_m=[0.05, -0.01, 0.2],
    tip_commanded_position_m=[0.051, 0.0, 0.2],
    length_estimated_m=[0.1999, 0.2, 0.3],
    pressure_measured_pa=[1e5, -2e4, 0.0],
)


def test_units() -> None:
    assert millimetres([0.1, -0.00004, 2.0]) == "(100.0, -0.0, 2000.0)"
    assert bars([1e5, -2e4]) == "(+1.000, -0.200)"
    assert radians([180.0, -90.0]) == pytest.approx([3.14159265, -1.57079633])
    assert radians(None) is None


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (0, []),
        (1, ["length", "Eq. (4)"]),
        (2, ["bend"]),
        (4, ["pressure"]),
        (6, ["bend", "pressure"]),
        (7, ["length", "Eq. (4)", "bend", "pressure"]),
        (8, ["keep-out"]),
    ],
)
def test_the_limits_that_bind_are_named_and_no_others(flags: int, told: list[str]) -> None:
    every = ["length", "Eq. (4)", "bend", "pressure", "keep-out"]
    away = pb.ArmState()
    away.CopyFrom(STATE)
    away.binding_limits = flags
    assert [word for word in every if word in outcome(away)] == told


def test_a_state_is_one_line() -> None:
    assert state_line(STATE) == (
        "#12  active  tip (50.0, -10.0, 200.0) mm  "
        "position (60.0, 20.0, 190.0) mm out of reach, error 12.34 mm  "
        "lengths (199.9, 200.0, 300.0) mm  pressures (+1.000, -0.200, +0.000) bar"
    )


def test_a_state_without_target_and_with_unknown_values_is_one_line_too() -> None:
    assert state_line(pb.ArmState(mode=pb.IDLE)) == (
        "#0  idle  tip () mm  lengths () mm  pressures () bar"
    )
    twist = pb.ArmState(mode=pb.ACTIVE, target_kind=pb.TWIST, reach=pb.MOVING)
    assert "  twist moving, error 0.00 mm  " in state_line(twist)


def test_how_a_target_ended() -> None:
    reached = pb.ArmState()
    reached.CopyFrom(STATE)
    reached.reach, reached.target_error_m = pb.REACHED, 0.0001
    assert outcome(reached) == (
        "reached: tip at (50.0, -10.0, 200.0) mm (estimated), commanded error 0.10 mm"
    )
    away = outcome(STATE)
    assert away.startswith("out of reach")
    assert "length, Eq. (4) and pressure binds" in away
    assert "(51.0, 0.0, 200.0) mm" in away
    assert "12.3 mm" in away


def test_a_state_says_while_the_log_lacks_something() -> None:
    lacking = pb.ArmState()
    lacking.CopyFrom(STATE)
    lacking.log_missed = 1234
    assert "1234" in state_line(lacking)
    assert state_line(lacking).startswith(state_line(STATE))
